# SPDX-License-Identifier: GPL-3.0-or-later
"""The wetness of each strand equals the kernel's amount of its Wet style."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.styling import program, random_numbers, strand_wetness, wet
from hair_addon.core.styling.masks import Inputs, Mask
from tests.support.strands.styled import straight

WET = wet.Settings(lock=0.03, seed=3)
PLACES = replace(WET, mask="places")
VARIED = replace(WET, vary=0.5, seed=4)


@pytest.fixture(scope="module")
def hair():
    return straight(200)


def inputs_of(hair, style, **mask):
    return Inputs(masks={program.mask_key(style): Mask(**mask)})


def half(hair):
    """Return (F, 3) weights: one on one half of the square, zero on the other."""
    x = hair.mesh.vertices[hair.mesh.triangles][:, :, 0].mean(axis=1)
    return np.repeat((x > np.median(x)).astype(np.float32)[:, None], 3, axis=1)


def test_strands_alike_have_no_wetness_of_their_own(hair):
    assert hair.bound(WET).wetness() is None
    assert hair.bound(WET, VARIED).wetness() is None  # nothing is wetter than the first
    assert hair.bound(replace(WET, amount=0.3), VARIED).wetness() is not None
    off = replace(PLACES, is_on=False)
    assert not strand_wetness.is_uneven([off, replace(PLACES, amount=0.0)])


@pytest.mark.parametrize("weight", [0.0, 0.25, 1.0])
def test_an_even_mask_gives_its_part_of_the_amount(hair, weight):
    style = replace(PLACES, amount=0.6)
    corners = np.full((len(hair.mesh.triangles), 3), weight, np.float32)
    found = hair.bound(style, inputs=inputs_of(hair, style, corners=corners)).wetness()
    np.testing.assert_allclose(found, np.full(200, 0.6 * weight), rtol=1e-6)


def test_strands_are_wet_where_they_change(hair):
    """With a mask of zeros and ones, inverted too, strands that the style changes are soaked and others dry."""
    plain = replace(PLACES, cling=0.0)  # strands beside wet guides that lean would lean too
    for style in (plain, replace(plain, invert_mask=True)):
        inputs = inputs_of(hair, style, corners=half(hair), is_inverted=style.invert_mask)
        found = hair.bound(style, inputs=inputs).wetness()
        has_changed = (hair.styled(style, inputs=inputs) != hair.styled()).any(axis=(1, 2))
        assert set(found.round(6)) == {0.0, 1.0}
        assert not has_changed[found == 0.0].any() and has_changed[found > 0.0].mean() > 0.9


def test_variation_takes_from_each_strand_a_part_of_its_own(hair):
    style = replace(WET, amount=0.8, vary=0.5)
    styling = hair.bound(style)
    numbers = random_numbers.random_numbers(styling.data.identities.numpy(), WET.seed, random_numbers.VARY)
    np.testing.assert_allclose(styling.wetness(), 0.8 * (1.0 - 0.5 * numbers), rtol=1e-6)


def test_the_wettest_style_counts(hair):
    """The wettest style counts in each strand, in any order."""
    low = replace(WET, amount=0.4, seed=4)
    inputs = inputs_of(hair, PLACES, corners=half(hair))
    found = hair.bound(low, PLACES, inputs=inputs).wetness()
    np.testing.assert_array_equal(found, hair.bound(PLACES, low, inputs=inputs).wetness())
    assert set(found.round(6)) == {np.float32(0.4), np.float32(1.0)}


def test_the_mean_amount_is_that_of_many_strands():
    varied = replace(VARIED, amount=0.8)
    found = strand_wetness.of_strands([varied], {}, np.arange(100_000, dtype=np.int32))
    assert abs(found.mean() - strand_wetness.mean_amount(varied)) < 0.002
