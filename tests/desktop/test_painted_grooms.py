# SPDX-License-Identifier: GPL-3.0-or-later
"""The grooms of the manual's page on maps, made in a window, have the values that were painted."""

import numpy as np
import pytest

from tests.desktop import walks

pytestmark = pytest.mark.desktop


@pytest.fixture
def groom(request, desktop, extension, new_profile):
    """Return a function that makes a groom in a window and returns its facts."""

    def make(name):
        walk = walks.take(
            desktop,
            "painted_grooms",
            extension,
            new_profile(),
            "opengl",
            parts=(name,),
            folder=f"painted_{name}",
            size=(560, 440),
        )
        walk.assert_done()
        assert walk.complaints() == []
        return walk.facts

    return make


def test_painted_stripes_are_black_and_the_coat_beside_them_stays(groom):
    facts = groom("tiger")
    assert facts["mode"] == "PAINT_TEXTURE" and facts["is painted"] > 20
    assert facts["orange"] < 2e-3 and facts["far away"] > 0.99
    assert facts["share"] > 0.9 and np.allclose(facts["painted"], (0.006, 0.005, 0.005), atol=1e-3)
    assert facts["darker"] < 0.4 and abs(facts["as before"] - 1.0) < 0.04


@pytest.mark.long
def test_a_painted_mask_gives_patches_of_the_colors_of_a_ramp(groom):
    facts = groom("calico")
    for weight in ("0.0", "0.5", "1.0"):
        count, error = facts[weight]
        assert count > 50 and error < 2e-3


@pytest.mark.long
def test_a_painted_fade_has_the_painted_lengths(groom):
    facts = groom("fade")
    assert facts["error"] < 0.02
    assert (np.diff(facts["heights"]) > 0.0).all()
    assert facts["heights"][0] < 0.25 and facts["top"] > 0.95


@pytest.mark.long
def test_the_ends_of_each_lock_are_bleached_by_its_own_degree(groom):
    facts = groom("ombre")
    low, high = facts["factors"]
    assert 0.1 <= low < 0.2 and 0.9 < high <= 1.0
    assert facts["locks"] > 20 and facts["within a lock"] < 1e-4 and facts["of channels"] < 1e-4
    assert facts["root"] < 2e-3
    assert (np.array(facts["tip"]) > 1.8 * np.array((0.24, 0.052, 0.007))).all()


@pytest.mark.parametrize("name", ["brows", pytest.param("beard", marks=pytest.mark.long)])
def test_painted_hair_thins_out_at_its_edges(groom, name):
    """Counts, lengths and radii of strands follow the weights."""
    facts = groom(name)
    assert facts["length"] < 0.02 and facts["thickness"] < 0.01 and facts["bare"] == 0
    counts, wanted = np.array(facts["counts"]), np.array(facts["wanted"])
    assert (np.abs(counts - wanted) <= 4.0 * np.sqrt(wanted) + 0.03 * wanted).all()
    assert (wanted > 50).sum() >= 3
