# SPDX-License-Identifier: GPL-3.0-or-later
"""Clump gathers strands on their center's line, in locks of whole smaller locks."""

from copy import copy
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import strands
from hair_addon.core.grooming import following
from hair_addon.core.interpolation import sharp_edges
from hair_addon.core.long_work import Stopped
from hair_addon.core.styling import braid, clump, clump_trees, program
from hair_addon.core.styling.masks import Inputs
from hair_addon.core.styling.varied_numbers import NumberMap
from tests.support.dynamics.stepped import curved_strands, largest_move, stepped, straight_strands
from tests.support.strands.styled import ball, head, straight

FULL = clump.Settings(thickness=0.0, stray=0.0, root=1.0, tip=1.0, levels=1)


@pytest.fixture(scope="module")
def hair():
    return head(600, 60)


def bundle(rng, count=64, radius=0.006):
    """Return (S, P, 3) strands beside a curved one, each farther from it along its length."""
    centre = curved_strands(rng, 1)
    away = rng.uniform(-radius, radius, (count, 1, 3)) * (1.0, 1.0, 0.0)
    return (centre + away * np.linspace(1.0, 1.5, 41)[:, None]).astype(np.float32), centre


def distances_to(line, points):
    """Return (…,) distances [m] from points to a polyline (P, 3) with its last segment extended."""
    line, points = line.astype(np.float64), points.astype(np.float64)
    start, way = line[:-1], np.diff(line, axis=0)
    part = np.einsum("...nc,nc->...n", points[..., None, :] - start, way) / (way**2).sum(axis=1)
    part[..., :-1] = np.clip(part[..., :-1], 0.0, 1.0)
    part[..., -1] = np.maximum(part[..., -1], 0.0)
    return np.linalg.norm(points[..., None, :] - start - part[..., None] * way, axis=-1).min(axis=-1)


def test_full_strength_gathers_strands_on_the_line_of_their_centre(rng):
    strands, centre = bundle(rng)
    made = stepped(strands, FULL, centres=centre)
    assert distances_to(centre[0], strands[:, 16:]).max() > 5e-3
    assert distances_to(centre[0], made[:, 16:]).max() < 1e-5 * 0.2


def test_twice_is_once_on_the_line(rng):
    strands, centre = bundle(rng)
    twice = stepped(strands, FULL, FULL, centres=centre)
    assert distances_to(centre[0], twice[:, 16:]).max() < 1e-5 * 0.2


def test_tips_come_onto_the_line_as_well_by_a_profile(rng):
    strands, centre = bundle(rng)
    made = stepped(strands, replace(FULL, root=0.0), centres=centre)
    # In the last of forty steps the profile is at 39 of 40 parts.
    assert distances_to(centre[0], made[:, -1]).max() < 1e-4 * 0.2
    middle = distances_to(centre[0], made[:, 20]) / distances_to(centre[0], strands[:, 20])
    assert 0.2 < np.median(middle) < 0.9


@pytest.mark.parametrize("thickness", [0.12, 0.5, 0.9])
def test_thickness_multiplies_distances(thickness):
    strands = straight_strands(9, 0.2, 41, 0.001)
    made = stepped(strands, replace(FULL, thickness=thickness))
    np.testing.assert_allclose(made[:, 15:, 0] - 0.004, thickness * (strands[:, 15:, 0] - 0.004), atol=2e-6)


def test_a_lock_of_thickness_one_is_as_before(rng):
    strands, centre = bundle(rng)
    assert largest_move(stepped(strands, replace(FULL, thickness=1.0), centres=centre), strands) < 2e-6


def test_the_strand_of_the_centre_stays(rng):
    _strands, centre = bundle(rng)
    np.testing.assert_allclose(stepped(centre, FULL, centres=centre), centre, atol=1e-6)


def test_strands_leave_their_roots_by_degrees():
    """Strands leave their roots gradually: no first segment lies flat, also where the profile is full at the root."""
    strands = straight_strands(9, 0.2, 41, 0.003)
    for settings in (FULL, replace(FULL, root=0.0, shape=0.32)):
        segments = np.diff(stepped(strands, settings), axis=1)
        assert (segments[:, :, 2] / np.linalg.norm(segments, axis=2)).min() > 0.65


def test_a_shorter_strand_ends_higher_up():
    """A shorter strand ends at its own length along the center, not at the center's tip."""
    strands = straight_strands(5, 0.2, 41, 0.001)
    strands[0, :, 2] *= 0.5
    made = stepped(strands, FULL, centres=strands[2:3])
    assert 0.099 < made[0, -1, 2] < 0.1 and 0.199 < made[1, -1, 2] < 0.2


def test_a_longer_strand_goes_straight_on():
    strands = straight_strands(5, 0.2, 41, 0.001)
    made = stepped(strands, FULL, centres=0.5 * strands[2:3])
    np.testing.assert_allclose(made[:, -1], np.tile([0.001, 0.0, 0.2], (5, 1)), atol=1e-3)


def test_a_twist_turns_locks_about_their_centre():
    strands = straight_strands(9, 0.2, 41, 0.001)
    settings = replace(FULL, thickness=0.9, twist=0.5, root=0.0, shape=0.5)
    away = (stepped(strands, settings) - [0.004, 0.0, 0.0])[[0, 8]]
    angle = np.unwrap(np.arctan2(away[:, :, 1], away[:, :, 0]), axis=1)
    turns = (angle - angle[:, :1]) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.tile(0.5 * np.linspace(0.0, 1.0, 41), (2, 1)), atol=0.01)


def test_strays_join_no_lock():
    strands = straight_strands(600, 0.2, 41, 0.00001)
    made = stepped(strands, replace(FULL, stray=1.0))
    is_joined = np.abs(made - strands).max(axis=(1, 2)) > 1e-5
    assert not is_joined.any()
    some = stepped(strands, replace(FULL, stray=0.3))
    assert (np.abs(some - strands)[:, :, 0].max(axis=1) < 1e-6).mean() == pytest.approx(0.25, abs=0.06)


def test_locks_are_made_of_whole_smaller_locks(hair):
    settings = clump.Settings(levels=3, size=0.03, ratio=0.5)
    bound = hair.bound(settings)
    members = bound.data.members.numpy()[:3]
    for coarse, fine in pairwise(members):
        assert len(np.unique(np.stack([coarse, fine]), axis=1).T) == len(np.unique(fine))
    assert len(np.unique(members[0])) < len(np.unique(members[1])) < len(np.unique(members[2]))


def test_a_strand_belongs_to_the_nearest_centre(hair):
    settings = clump.Settings(levels=2, size=0.03, crossover=0.0)
    bound = hair.bound(settings)
    centres = bound.levels[1].binding.positions.numpy()
    apart = np.linalg.norm(hair.binding.positions.numpy()[:, None] - centres, axis=-1)
    own = np.take_along_axis(apart, bound.data.members.numpy()[1][:, None], 1)[:, 0]
    is_nearest = own <= apart.min(axis=1) + 1e-6
    # At the ears, the nearest center may be on the other side.
    facing = np.einsum(
        "sc,sc->s", hair.binding.normals.numpy(), bound.levels[1].binding.normals.numpy()[apart.argmin(axis=1)]
    )
    assert is_nearest.mean() > 0.98 and np.all(is_nearest | (facing < np.cos(sharp_edges.BEGIN)))


@pytest.mark.parametrize("style", [clump.Settings(size=0.03, stray=0.0), braid.Settings(size=0.03)])
def test_no_strand_is_drawn_across_a_parting(style):
    """At a parting of 75° without a part line, strands of 20 cm are drawn across by up to 13 cm without the limits."""
    parted = straight(600, 0.2, 0.2)
    points = parted.guides.numpy()
    middle = np.median(points[:, 0, 0])
    side = np.sign(points[:, 0, 0] - middle)
    directions = np.stack([side * np.sin(0.65), 0.0 * side, np.cos(0.65) + 0.0 * side], axis=1)
    points = points[:, :1] + np.linspace(0.0, 0.2, 41)[:, None] * directions[:, None]
    guides = strands.from_numpy(np.float32(points), parted.guides.roots)
    plain, styled = (parted.styled(*styles, guides=guides)[:, :, 0] - middle for styles in ((), (style,)))
    side = np.sign(plain[:, -1:])
    assert np.all((side * styled).min(axis=1) > np.minimum((side * plain).min(axis=1), 0.0) - 1e-3)
    assert np.abs(styled - plain).max() > 0.01


def test_strands_of_a_lock_with_a_short_center_stay(rng):
    """Hair next to a cut does not follow the extension of a short center."""
    strands, centre = bundle(rng)
    made = [stepped(strands, FULL, centres=centre[:, :1] + part * (centre - centre[:, :1])) for part in (0.3, 0.6)]
    np.testing.assert_allclose(made[0], strands, atol=1e-6)
    assert np.abs(made[1] - strands).max() > 1e-3


def test_a_part_of_the_strands_crosses_over(hair):
    plain = hair.bound(clump.Settings(crossover=0.0)).data.members.numpy()[1]
    crossed = hair.bound(clump.Settings(crossover=0.3)).data.members.numpy()[1]
    assert (plain != crossed).mean() == pytest.approx(0.3, abs=0.06)


def test_locks_are_known_by_their_finest_level(hair):
    settings = clump.Settings(levels=2)
    bound = hair.bound(settings)
    locks, numbers = bound.clumps()
    np.testing.assert_array_equal(locks, bound.data.members.numpy()[1])
    assert locks.dtype == np.int32 and np.all((numbers >= 0.0) & (numbers < 1.0))
    for lock in np.unique(locks):
        assert len(np.unique(numbers[locks == lock])) == 1
    assert hair.bound(clump.Settings(is_on=False), replace(settings, seed=3)).clumps() is not None


def test_sites_are_as_many_as_the_size_says(hair):
    for size in (0.01, 0.02):
        tree = program.tree_settings(clump.Settings(size=size, levels=1))
        sites = hair.trees.levels(tree)[0].positions.numpy()
        assert len(sites) == pytest.approx(hair.trees.area / (0.866 * size**2), abs=1.0)
        apart = np.linalg.norm(sites[:, None] - sites, axis=-1) + np.eye(len(sites))
        assert np.median(apart.min(axis=1)) == pytest.approx(size, rel=0.25)


def test_progress_of_placing_locks_rises_and_may_stop_it(hair):
    """The progress of placing locks rises and may stop it, which leaves nothing, and later placing is the same."""
    settings = clump.Settings(size=0.03, levels=3, seed=11)
    tree, told = program.tree_settings(settings), []

    def stop(step, part):
        told.append(part)
        if part > 0.5:
            raise Stopped

    with pytest.raises(Stopped):
        hair.trees.search([tree, tree], stop)
    assert len(told) > 10 and hair.trees.lacks([tree, tree]) == [tree]
    heard = []
    hair.trees.search([tree, tree], lambda step, part: heard.append((step, part)))
    steps, parts = zip(*heard, strict=True)
    assert set(steps) == {"Placing locks"}
    assert list(parts) == sorted(parts) and parts[: len(told)] == tuple(told)
    assert parts[0] < 0.01 and parts[-1] > 0.9 and np.diff(parts).max() < 0.35
    assert hair.trees.lacks([tree]) == []
    hair.trees.search([tree], stop)  # the search has nothing to do
    found, at_once = hair.trees.levels(tree), hair.rooted(hair.binding.roots).trees.levels(tree)
    for one, other in zip(found, at_once, strict=True):
        np.testing.assert_array_equal(one.positions.numpy(), other.positions.numpy())


def test_locks_too_small_for_a_surface_are_larger_ones(hair, monkeypatch):
    """All levels grow by one factor, so that the finest has no more sites than there may be."""
    monkeypatch.setattr(clump_trees, "MOST_SITES", 200)
    area, counts = hair.trees.area, []
    for size in (0.08, 0.01, 1e-3, 1e-30):
        settings = clump.Settings(size=size, levels=2, ratio=0.5)
        tree = program.tree_settings(settings)
        factor = clump_trees.size_factor(area, tree)
        coarse, fine = (len(level.roots) for level in hair.trees.levels(tree))
        assert coarse == pytest.approx(area / (0.866 * (factor * size) ** 2), abs=1.0)
        assert fine == pytest.approx(4 * coarse, abs=4) and fine <= 200
        assert (factor == 1.0) == (area / (0.866 * (0.5 * size) ** 2) <= 200)
        counts.append(fine)
    assert counts[0] < 200 and counts[1:] == [200] * 3


def test_more_strength_gathers_more(hair):
    """Strands of a lock come closer together along their lengths with more strength."""
    spreads = []
    for amount in (0.01, 0.3, 0.6, 1.0):
        settings = clump.Settings(amount=amount, levels=1, size=0.03, stray=0.0)
        points = hair.styled(settings)
        locks = hair.bound(settings).clumps()[0]
        spreads.append(np.mean([points[locks == lock, 20].std(axis=0).sum() for lock in np.unique(locks)]))
    assert np.all(np.diff(spreads) < 0.0)


AT_GUIDES = clump.Settings(centers="GUIDES", center_guides="Some", levels=1, crossover=0.0, stray=0.0)


def chosen_of(hair, step=5):
    """Return `Inputs` with the selection of every so many guides."""
    return Inputs(guide_sets={"Some": np.arange(len(hair.guides.roots)) % step == 2})


@pytest.mark.parametrize(
    "settings",
    [AT_GUIDES, replace(AT_GUIDES, center_guides=""), braid.Settings(centers="GUIDES", center_guides="Some")],
)
def test_chosen_guides_are_the_centers_of_the_strands_nearest_to_them(hair, settings):
    """Centers are the chosen guides, all without a selection, and strands join the nearest by brute force."""
    inputs, guides = chosen_of(hair), hair.guides.numpy()
    chosen = guides[inputs.guide_sets["Some"]] if settings.center_guides else guides
    bound = hair.bound(settings, inputs=inputs)
    level = bound.levels[0].binding
    np.testing.assert_allclose(level.positions.numpy(), chosen[:, 0], atol=1e-6)
    apart = np.linalg.norm(hair.binding.positions.numpy()[:, None] - chosen[:, 0], axis=-1)
    members = bound.data.members.numpy()[0]
    is_nearest = apart[np.arange(len(apart)), members] <= apart.min(axis=1) + 1e-6
    facing = np.einsum("sc,sc->s", hair.binding.normals.numpy(), level.normals.numpy()[apart.argmin(axis=1)])
    assert np.all(is_nearest | (facing < np.cos(sharp_edges.BEGIN))) and is_nearest.mean() > 0.9
    centres = following.strands_now(level, hair.guides, following.weights_now(level, hair.guides)).numpy()
    np.testing.assert_allclose(centres, chosen, atol=1e-5)


def test_strands_end_on_the_guides_at_the_centers(rng):
    """Also between guides that lean in different directions, where a blended center would end beside its guide."""
    upright = straight(400, 0.2, 0.06)
    points = upright.guides.numpy().copy()
    points += np.linspace(0.0, 0.05, 41)[:, None] * rng.normal(size=(len(points), 1, 3)) * [1.0, 1.0, 0.0]
    guides = strands.from_numpy(np.float32(points), upright.guides.roots)
    settings = replace(AT_GUIDES, thickness=0.0, root=1.0)
    inputs = chosen_of(upright)
    made = upright.styled(settings, inputs=inputs, guides=guides)
    members = upright.bound(settings, inputs=inputs).data.members.numpy()[0]
    assert len(np.unique(members)) == inputs.guide_sets["Some"].sum()
    own = points[inputs.guide_sets["Some"]][members]
    courses = [points[:, -1] - points[:, 0] for points in (upright.styled(guides=guides), own)]
    plain, center = (course / np.linalg.norm(course, axis=1, keepdims=True) for course in courses)
    is_inside = np.sum(plain * center, axis=1) > np.cos(np.radians(25.0))
    away = np.array([distances_to(line, tip) for line, tip in zip(own, made[:, -1], strict=True)])
    assert is_inside.mean() > 0.8 and away[is_inside].max() < 1e-4


def test_finer_locks_are_as_before_and_join_the_nearest_guide(hair):
    finer = replace(AT_GUIDES, levels=3, size=0.03, ratio=0.5)
    at_guides, automatic = (
        hair.bound(settings, inputs=chosen_of(hair)) for settings in (finer, replace(finer, centers="AUTOMATIC"))
    )
    for level in (1, 2):
        one, other = (bound.levels[level].binding.positions.numpy() for bound in (at_guides, automatic))
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(at_guides.data.members.numpy()[1:3], automatic.data.members.numpy()[1:3])
    for coarse, fine in pairwise(at_guides.data.members.numpy()[:3]):
        assert len(np.unique(np.stack([coarse, fine]), axis=1).T) == len(np.unique(fine))


@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_locks_at_guides_scale_with_the_surface(factor):
    fur = ball(200)
    larger = copy(fur)
    larger.mesh = replace(fur.mesh, vertices=np.float32(factor * fur.mesh.vertices))
    larger.guides = strands.from_numpy(np.float32(factor * fur.guides.numpy()), fur.guides.roots)
    larger = larger.rooted(fur.binding.roots)
    inputs = chosen_of(fur)
    one, other = (each.styled(AT_GUIDES, inputs=inputs) for each in (fur, larger))
    np.testing.assert_allclose(other / factor, one, atol=1e-4)
    assert np.abs(one - fur.plain).max() > 0.01


def test_sizes_by_a_map_share_the_chosen_guides(hair):
    settings = replace(AT_GUIDES, levels=2, size=0.04)
    number = NumberMap(lambda roots, ids, _clumps: np.where(ids % 2 == 0, 0.04, 0.02))
    inputs = replace(chosen_of(hair), numbers={(0, "size"): number})
    varied = hair.styled(settings, inputs=inputs)
    for size in (0.04, 0.02):
        alone = hair.styled(replace(settings, size=size), inputs=chosen_of(hair))
        own = number.read(None, hair.binding.identities[0], None) == size
        np.testing.assert_array_equal(varied[own], alone[own])


@pytest.mark.parametrize("are_chosen", [None, np.zeros(60, bool), np.ones(59, bool), np.ones(61, bool)])
def test_selections_that_do_not_fit_are_refused(hair, are_chosen):
    sets = {} if are_chosen is None else {"Some": are_chosen}
    with pytest.raises(HairError, match=r"selection|Hair data does not match"):
        hair.bound(AT_GUIDES, inputs=Inputs(guide_sets=sets))
    hair.bound(replace(AT_GUIDES, is_on=False), clump.Settings(), inputs=Inputs(guide_sets=sets))
