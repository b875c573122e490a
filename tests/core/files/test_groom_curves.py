# SPDX-License-Identifier: GPL-3.0-or-later
"""Data for other programs have three guides of each strand, names of groups, and limits."""

import numpy as np
import pytest

from hair_addon.core.files import groom_curves


@pytest.mark.parametrize("slots", [1, 2, 3, 6])
def test_the_closest_guides_are_those_that_weigh_most(rng, slots):
    guide_count, strand_count = 9, 200
    indices = np.array([rng.permutation(guide_count)[:slots] for _ in range(strand_count)], np.int32)
    weights = rng.random((strand_count, slots)).astype(np.float32)
    indices[rng.random(indices.shape) < 0.3] = -1
    ids, shares = groom_curves.closest_guides(indices, weights, 1000)
    assert ids.dtype == np.int32 and shares.dtype == np.float32 and ids.shape == shares.shape == (strand_count, 3)
    for strand in range(strand_count):
        wanted = sorted(
            ((w, i) for i, w in zip(indices[strand], weights[strand], strict=True) if i >= 0), reverse=True
        )[:3]
        total = sum(w for w, _ in wanted)
        found = [(s, i) for i, s in zip(ids[strand], shares[strand], strict=True) if s > 0.0]
        assert [i for _, i in found] == [1000 + i for _, i in wanted]
        np.testing.assert_allclose([s for s, _ in found], [w / total for w, _ in wanted], rtol=1e-6)
        repeated = ids[strand][shares[strand] == 0.0]
        assert (repeated == (1000 + wanted[0][1] if wanted else 1000)).all()


def test_three_guides_interpolate_as_all_where_no_more_weigh(rng):
    guides = rng.random((9, 5, 3))
    indices = np.array([rng.permutation(9)[:3] for _ in range(20)], np.int32)
    weights = rng.dirichlet(np.ones(3), 20)
    ids, shares = groom_curves.closest_guides(indices, weights, 0)
    everything = np.einsum("sk,skpx->spx", weights, guides[indices])
    np.testing.assert_allclose(np.einsum("sk,skpx->spx", shares, guides[ids]), everything, atol=1e-6)


def test_names_of_groups_differ_and_keep_to_the_letters_that_all_programs_take():
    names = ["Hair", "Hair", "Hair 2", "Hair_2", "…", "", "3rd", "Bart äöü", "/a/b", "x" * 100]
    made = groom_curves.group_names(names)
    assert len(set(made)) == len(names) and made[0] == "Hair"
    assert all(name.isascii() and name.isidentifier() for name in made)
    assert groom_curves.group_names(made) == made


def test_no_two_objects_of_a_file_are_called_the_same():
    """No two objects of a file have the same name, although guides are named after their group."""
    for names in (["Hair", "Hair_guides", "materials"], ["Hair_guides", "Hair", "materials"]):
        made = groom_curves.group_names(names, {"materials"})
        objects = [*made, *map(groom_curves.guides_name, made), "materials"]
        assert len(set(objects)) == len(objects)


def test_slices_cover_all_curves_once():
    for count in (0, 1, groom_curves.AT_ONCE, groom_curves.AT_ONCE + 1, 5 * groom_curves.AT_ONCE):
        assert [i for chosen in groom_curves.slices(count) for i in range(count)[chosen]] == list(range(count))


def test_the_limits_of_unreal_are_reported_only_beyond_them():
    def notes(*counts_and_points):
        return [*groom_curves.limit_notes("a", np.concatenate([np.full(*one) for one in counts_and_points]))]

    assert notes((groom_curves.MOST_CURVES_OF_GROUP, 4)) == []
    assert notes((65_793, 255)) == [] and notes((60_000, 5), (60_000, 255)) == []
    assert "256" in str(notes((60_000, 3), (1, 256))[0])
    for case, word in (((2**22, 2), "strands"), ((2**22 - 1, 5), "points")):
        (note,) = notes(case)
        assert word in str(note)
