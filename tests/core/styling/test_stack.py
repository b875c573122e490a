# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles bound to hair reach the strands of a stroke, limit the work of a slider, and separate regions."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from hair_addon.core import placement
from hair_addon.core.errors import HairError
from hair_addon.core.geometry.search import hash_grid
from hair_addon.core.geometry.strands import from_numpy
from hair_addon.core.grooming.groom import GuideSettings, HairSettings
from hair_addon.core.interpolation import guide_weights
from hair_addon.core.interpolation.regions import Regions
from hair_addon.core.kernels import kernel_cache
from hair_addon.core.styling import braid, clump, curl, frizz, guide_lean, lean, program, smooth, steps, wet
from hair_addon.core.styling.masks import Inputs, Mask
from hair_addon.core.styling.stack import HAIR
from tests.support.devices import DEVICE
from tests.support.meshes import flat_grid
from tests.support.strands.styled import Groom, head

STACK = (clump.Settings(size=0.03, levels=3), curl.Settings(seed=1), frizz.Settings(seed=2))
STACKS = {
    "no clump": (curl.Settings(), frizz.Settings(seed=1)),
    "levels": STACK,
    "two clumps": (clump.Settings(size=0.04), curl.Settings(), clump.Settings(size=0.015, levels=1, seed=4)),
    "wet": (frizz.Settings(), wet.Settings()),
    "braid": (braid.Settings(),),
}


@pytest.fixture(scope="module")
def hair():
    return head(500, 60)


def combed_guides(hair, chosen, amount=0.01):
    """Return the guides with some of them moved."""
    points = hair.guides.numpy().copy()
    points[chosen, 1:, 0] += amount * np.linspace(0.0, 1.0, points.shape[1] - 1)
    return from_numpy(points, hair.guides.roots, hair.device)


@pytest.mark.parametrize("name", STACKS)
def test_a_stroke_reaches_every_strand_that_moves(hair, name):
    """A stroke reaches every strand that moves, and no strand without a moved guide or a moved center."""
    bound = hair.bound(*STACKS[name])
    followers = guide_weights.reach(hair.binding.guide_weights, len(hair.guides))
    before = hair.styled(*STACKS[name])
    for chosen in ([3], [10, 41], []):
        after = hair.styled(*STACKS[name], guides=combed_guides(hair, chosen))
        is_moved = (before != after).any(axis=(1, 2))
        reached = bound.reached(np.array(chosen, int), followers.of(np.array(chosen, int)))
        assert np.all(np.diff(reached) > 0)
        assert set(np.flatnonzero(is_moved)) <= set(reached)
        assert len(reached) <= 1.6 * max(is_moved.sum(), 10)


@pytest.mark.parametrize("name", STACKS)
def test_strands_that_are_reached_are_as_in_a_full_update(hair, name):
    guides = combed_guides(hair, [5, 6])
    followers = guide_weights.reach(hair.binding.guide_weights, len(hair.guides)).of(np.array([5, 6]))
    reached = hair.bound(*STACKS[name]).reached(np.array([5, 6]), followers).astype(np.int32)
    full = hair.styled(*STACKS[name], guides=guides)
    np.testing.assert_array_equal(hair.styled(*STACKS[name], guides=guides, chosen=reached), full[reached])


def test_guides_that_lean_as_before_are_not_computed_again(hair, monkeypatch):
    """Leaned guides are reused if another style changes; otherwise they are computed, with the same bits."""
    styles = lean.Settings(amount=0.7), curl.Settings()
    first = hair.bound(*styles)
    wanted = first.guides(hair.guides).numpy()
    same, other = hair.bound(styles[0], curl.Settings(radius=0.01)), hair.bound(lean.Settings(amount=0.6), styles[1])
    computed = []
    real = guide_lean.leaned
    monkeypatch.setattr(guide_lean, "leaned", lambda *given: computed.append(1) or real(*given))
    for styling, count in ((same, 0), (other, 1)):
        styling.followed.continue_from(first.followed)
        found = styling.guides(hair.guides).numpy()
        assert len(computed) == count
        assert np.array_equal(found, wanted) == (count == 0)


@pytest.mark.parametrize("point_count", [41, 81])
def test_guides_that_were_combed_are_followed_as_all_are(hair, point_count):
    """Guides that are followed one after another or at once give the same bits."""
    styles = lean.Settings(amount=0.7), wet.Settings(amount=0.5)
    bound = hair.bound(*styles, point_count=point_count)
    bound.guides(hair.guides)
    for chosen in ([3], [3, 10, 41], []):
        guides = combed_guides(hair, chosen)
        after_each_other = bound.guides(guides).numpy()
        at_once = hair.bound(*styles, point_count=point_count).guides(guides).numpy()
        np.testing.assert_array_equal(after_each_other, at_once)
        assert at_once.shape == (60, point_count, 3)


def test_guides_stay_as_they_were_combed(hair):
    before = hair.guides.numpy().copy()
    hair.styled(lean.Settings(), wet.Settings(), *STACK)
    np.testing.assert_array_equal(hair.guides.numpy(), before)
    assert hair.bound(curl.Settings()).guides(hair.guides) is hair.guides


class Counts:
    """Counts searches, places of sites and launches from now on."""

    def __init__(self, monkeypatch):
        self.searches = self.sites = self.launches = 0
        for module, name, count in (
            (hash_grid, "neighbours", "searches"),
            (placement.cvt, "place", "sites"),
            (kernel_cache, "launch", "launches"),
        ):
            monkeypatch.setattr(module, name, self._counted(getattr(module, name), count))

    def _counted(self, real, count):
        def wrapper(*args, **kwargs):
            setattr(self, count, getattr(self, count) + 1)
            return real(*args, **kwargs)

        return wrapper


def test_a_slider_searches_and_places_nothing(hair, monkeypatch):
    trees = replace(hair.trees, _levels={}, _members={}, _parents={})
    monkeypatch.setattr(hair, "trees", trees)
    hair.styled(*STACK)
    counts = Counts(monkeypatch)
    others = (
        replace(STACK[0], amount=0.5, twist=1.0, thickness=0.3, fine_amount=0.1, shape=0.9),
        replace(STACK[1], radius=0.002, coherence=0.1),
        replace(STACK[2], amplitude=0.001, octaves=3, seed=9),
    )
    hair.styled(*others)
    hair.styled(*reversed(others))
    assert (counts.searches, counts.sites) == (0, 0)


def test_a_structural_setting_places_sites_of_its_own_style_alone(hair, monkeypatch):
    trees = replace(hair.trees, _levels={}, _members={}, _parents={})
    monkeypatch.setattr(hair, "trees", trees)
    styles = clump.Settings(size=0.03, levels=2), wet.Settings()
    hair.styled(*styles)
    counts = Counts(monkeypatch)
    hair.styled(replace(styles[0], size=0.04), styles[1])
    assert counts.sites == 2
    hair.styled(*styles)
    assert counts.sites == 2  # those before are kept


def test_other_weights_of_guides_keep_sites(hair, monkeypatch):
    trees = replace(hair.trees, _levels={}, _members={}, _parents={})
    tree = program.tree_settings(STACK[0])
    trees.members(HAIR, hair.binding, tree)
    counts = Counts(monkeypatch)
    again = trees.reweighed(replace(hair.settings, influence_distance=0.05))
    again.members(HAIR, hair.binding, tree)
    again.levels(tree)
    assert (counts.searches, counts.sites) == (0, 0)


def test_no_style_launches_nothing(hair, monkeypatch):
    assert hair.bound() is None
    assert hair.bound(curl.Settings(is_on=False), frizz.Settings(amount=0.0)) is None
    bound = hair.bound(point_count=61)
    counts = Counts(monkeypatch)
    bound.apply(None, None)
    assert counts.launches == 0


def regions_of(mesh):
    """Return (F, 3) int32: two halves of a square."""
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    labels = (middles[:, 0] > 0.5 * mesh.vertices[:, 0].max()).astype(np.int32)
    return Regions(np.repeat(labels[:, None], 3, axis=1))


def parted_line(mesh):
    """Return (L, 2, 3): a line through the middle of a square, from beyond one side to beyond the other."""
    size = mesh.vertices[:, 0].max()
    y = np.linspace(-0.2, 1.2, 15) * size
    line = np.stack([np.full(15, 0.5 * size), y, np.zeros(15)], axis=1).astype(np.float32)
    return np.stack([line[:-1], line[1:]], axis=1)


@pytest.mark.parametrize("kind", ["regions", "lines"])
@pytest.mark.parametrize("name", STACKS)
def test_no_style_mixes_across_regions_and_part_lines(kind, name):
    """Guides on one side move, and no strand of the other side does."""
    mesh = flat_grid(8, 0.1)
    ground = {"regions": {"regions": (regions_of(mesh),)}, "lines": {"lines": parted_line(mesh)}}[kind]
    guides = GuideSettings(guide_count=40, length=0.2)
    hair = Groom(mesh, guides, HairSettings(strand_count=400, radius=4e-5), DEVICE, **ground)
    right = hair.guides.numpy()[:, 0, 0] > 0.05
    before = hair.styled(*STACKS[name])
    after = hair.styled(*STACKS[name], guides=combed_guides(hair, np.flatnonzero(right)))
    is_moved = (before != after).any(axis=(1, 2))
    is_right = before[:, 0, 0] > 0.05
    assert is_moved[is_right].mean() > 0.9
    assert not is_moved[~is_right].any()


def test_a_region_without_a_site_joins_no_lock():
    """A region without a site joins no lock: with fewer sites than regions, its strands remain alone."""
    mesh = flat_grid(8, 0.1)
    labels = (np.arange(len(mesh.triangles)) // 2 % 8).astype(np.int32)
    regions = (Regions(np.repeat(labels[:, None], 3, axis=1)),)
    guides = GuideSettings(guide_count=80, length=0.2)
    hair = Groom(mesh, guides, HairSettings(strand_count=300, radius=4e-5), DEVICE, regions=regions)
    settings = clump.Settings(size=0.06, levels=1, stray=0.0)
    region = labels[hair.guides.roots.triangle]
    for label in range(8):
        others = np.flatnonzero(region != label)
        is_own = labels[hair.binding.roots.triangle] == label
        before, after = hair.styled(settings), hair.styled(settings, guides=combed_guides(hair, others))
        assert not (before != after).any(axis=(1, 2))[is_own].any()


def test_arrays_that_do_not_fit_are_refused(hair):
    bound = hair.bound(*STACK)
    strands = from_numpy(np.zeros((7, 41, 3), np.float32), hair.binding.roots[:7], hair.device)
    with pytest.raises(HairError):
        steps.apply_steps(strands.points, bound.program, bound.data, np.eye(4))
    wrong = replace(bound.program, choices=np.full_like(bound.program.choices, 99))
    all_strands = from_numpy(np.zeros((500, 41, 3), np.float32), hair.binding.roots, hair.device)
    with pytest.raises(HairError):
        steps.apply_steps(all_strands.points, wrong, bound.data, np.eye(4))
    for point_count in (1, 258):
        strands = from_numpy(np.zeros((500, point_count, 3), np.float32), hair.binding.roots, hair.device)
        with pytest.raises(HairError, match="points"):
            steps.apply_steps(strands.points, bound.program, bound.data, np.eye(4))


@pytest.mark.parametrize("stack", ["levels", "no clump"])
@pytest.mark.parametrize("member", [-2, 10**6])
def test_strands_and_centres_that_are_not_there_are_refused(hair, stack, member):
    """Missing strands and centers are refused, as members of the first level of clumps or of the guides."""
    bound = hair.bound(*STACKS[stack])
    points = from_numpy(np.zeros((500, 41, 3), np.float32), hair.binding.roots, hair.device).points
    members = bound.data.members.numpy().copy()
    members[0, 3] = member
    data = replace(bound.data, members=wp.array(members, dtype=int, device=hair.device))
    with pytest.raises(HairError, match="clump"):
        steps.apply_steps(points, bound.program, data, np.eye(4))
    with pytest.raises(HairError, match="strands"):
        hair.styled(*STACKS[stack], chosen=np.array([3, member]))


FIELDS = ("normals", "identities", "masks", "members", "centre_normals", "centre_identities")
LOCKS, CURLS, FRIZZ = STACK[0], replace(STACK[1], mask="shared"), STACK[2]
OTHERS = {
    "slider": (LOCKS, replace(CURLS, amount=0.5), FRIZZ),
    "crossover": (replace(LOCKS, crossover=0.3), CURLS, FRIZZ),
    "fewer levels": (replace(LOCKS, levels=2), CURLS, FRIZZ),
    "other locks": (replace(LOCKS, size=0.04), CURLS, FRIZZ),
    "more locks": (LOCKS, clump.Settings(size=0.015, levels=1, seed=4), CURLS, FRIZZ),
    "no locks": (CURLS, FRIZZ),
    "another mask": (LOCKS, replace(CURLS, mask="own"), FRIZZ),
    "another order": (FRIZZ, LOCKS, CURLS),
}


@pytest.mark.parametrize("name", OTHERS)
def test_a_former_styling_does_not_change_the_next(hair, rng, name):
    """Styles bound with the arrays of a former `Styling` have the same arrays as without; a slider copies none."""
    shared, own = ((mask, rng.random(60).astype(np.float32)) for mask in ("shared", "own"))
    masks = {program.mask_key(replace(CURLS, mask=mask)): Mask(guides=weights) for mask, weights in (shared, own)}
    before = hair.bound(LOCKS, CURLS, FRIZZ, inputs=Inputs(masks))
    fresh, reused = (hair.bound(*OTHERS[name], inputs=Inputs(masks), former=former) for former in (None, before))
    for one, other in zip([fresh, *fresh.levels], [reused, *reused.levels], strict=True):
        for label in FIELDS:
            np.testing.assert_array_equal(getattr(one.data, label).numpy(), getattr(other.data, label).numpy())
    is_kept = [getattr(reused.data, label) is getattr(before.data, label) for label in FIELDS]
    assert all(is_kept) == (name in ("slider", "another order"))
    assert reused.data.centre_points is not before.data.centre_points  # other threads may still write to it


def test_a_mask_of_guides_is_mixed_as_strands_are(hair, rng):
    """A mask of guides is mixed by the weights of the guides that a strand follows."""
    weights = rng.random(60).astype(np.float32)
    found = Mask(guides=weights).of_strands(hair.binding)
    indices, shares = hair.binding.guide_weights.indices.numpy(), hair.binding.guide_weights.weights.numpy()
    mixed = [
        sum(weights[i] * w for i, w in zip(*row, strict=True) if i >= 0) for row in zip(indices, shares, strict=True)
    ]
    np.testing.assert_allclose(found, mixed, atol=1e-6)


def test_smoothing_before_and_after_a_clump_differ(hair):
    """Styles act in order: smoothing before and after a clump differ."""
    first, second = smooth.Settings(length=0.1), frizz.Settings()
    assert np.abs(hair.styled(first, second) - hair.styled(second, first)).max() > 1e-3
