# SPDX-License-Identifier: GPL-3.0-or-later
"""Where sizes of locks differ, each strand is in the same lock as in hair with the strand's size everywhere."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.grooming import following
from hair_addon.core.styling import braid, clump, curl, wet
from hair_addon.core.styling.masks import Inputs
from hair_addon.core.styling.program import tree_settings
from hair_addon.core.styling.varied_numbers import MOST_SIZES, NumberMap, varied_trees
from tests.support.strands.styled import head

# Style, styles below it, {setting: (value in one half, value in the other half)}.
CASES = {
    "clump": (clump.Settings(crossover=0.1), (), {"size": (0.05, 0.02)}),
    "three levels": (clump.Settings(levels=3), (), {"size": (0.08, 0.03)}),
    "ratio and crossover": (clump.Settings(size=0.06), (), {"ratio": (0.6, 0.3), "crossover": (0.0, 0.5)}),
    "all": (clump.Settings(), (), {"size": (0.08, 0.05), "ratio": (0.6, 0.4), "crossover": (0.3, 0.0)}),
    "curl below": (clump.Settings(levels=2, tip_level=1), (curl.Settings(),), {"size": (0.05, 0.02)}),
    "two clumps": (clump.Settings(levels=1), (clump.Settings(levels=1, size=0.1, seed=3),), {"size": (0.05, 0.02)}),
    "braid": (braid.Settings(), (), {"size": (0.05, 0.1)}),
    "wet": (wet.Settings(), (), {"lock": (0.06, 0.03)}),
}


@pytest.fixture(scope="module")
def hair():
    return head(200, 30)


@pytest.fixture
def places(hair):
    """Return a function that returns the places (S,) of roots from one side of the head to the other [m]."""
    corners = hair.mesh.vertices[hair.mesh.triangles][..., 0]
    return lambda roots: (corners[roots.triangle] * roots.barycentric).sum(axis=1)


def centre_roots(styling):
    """Return for each level the roots (S, 4) of the centers of strands, as triangles and barycentric coordinates."""
    found = []
    for level, members in zip(styling.levels, styling.data.members.numpy(), strict=False):
        roots = level.binding.roots[members]
        found.append(np.concatenate([roots.triangle[:, None], roots.barycentric], axis=1))
    return found


@pytest.mark.parametrize("name", CASES)
def test_each_half_has_the_locks_of_its_own_size(hair, places, name):
    """Where sizes differ between two halves, each strand has the bits of hair with this strand's size."""
    style, below, values = CASES[name]

    def varied(pair):
        return NumberMap(lambda roots, _ids, _clumps: np.where(places(roots) > 0.0, pair[1], pair[0]))

    inputs = Inputs(numbers={(0, setting): varied(pair) for setting, pair in values.items()})
    found = hair.styled(style, *below, inputs=inputs)
    is_second = places(hair.binding.roots) > 0.0
    styling = hair.bound(style, *below, inputs=inputs)
    is_whole = np.ones(len(found), bool)
    if name == "two clumps":  # the center of a strand's second lock may be in the other half
        members, centres = styling.data.members.numpy()[1], styling.levels[1].binding.roots
        is_whole = (places(centres)[members] > 0.0) == is_second
    for half in (0, 1):
        same = is_whole & (is_second == half)
        own = replace(style, **{setting: pair[half] for setting, pair in values.items()}), *below
        for centres, others in zip(centre_roots(styling), centre_roots(hair.bound(*own)), strict=True):
            np.testing.assert_array_equal(centres[same], others[same])
        alone = hair.styled(*own)
        assert same.sum() > 50 and (found != alone).any()
        if name != "wet":  # guides and the centers of locks have a size of their own there
            np.testing.assert_array_equal(found[same], alone[same])


def test_one_size_is_the_setting(hair):
    """A map of one size has the bits of hair whose setting is this size, also if its own setting differs."""
    number = NumberMap(lambda roots, _ids, _clumps: np.full(len(roots), 0.02))
    style = clump.Settings(size=0.05)
    found = hair.styled(style, inputs=Inputs(numbers={(0, "size"): number}))
    np.testing.assert_array_equal(found, hair.styled(replace(style, size=0.02)))


def test_many_sizes_are_few_trees(hair, places):
    """Sizes of a gradient are replaced by few sizes in equal ratios; each strand has the nearest size."""
    number = NumberMap(lambda roots, _ids, _clumps: 0.03 + 0.5 * np.abs(places(roots)))
    style = clump.Settings()
    tree = varied_trees([style], {(0, "size"): number}, hair.binding)[0]
    assert 3 <= len(tree.tree.variants) <= MOST_SIZES
    other = NumberMap(lambda roots, _ids, _clumps: np.minimum(number.read(roots, None, None), 0.045))
    painted = varied_trees([style], {(0, "size"): other}, hair.binding)[0]
    assert set(painted.tree.variants) < set(tree.tree.variants)  # a painted map reuses its trees
    sizes = number.read(hair.binding.roots, None, None)
    trees = np.array([variant.sizes[0] for variant in tree.tree.variants])
    ratios = trees[tree.choice(hair.binding, None)] / sizes
    step = trees[1] / trees[0]
    assert max(ratios.max(), 1.0 / ratios.min()) <= step**0.5 * 1.0001
    assert np.isfinite(hair.styled(style, inputs=Inputs(numbers={(0, "size"): number}))).all()


def test_only_centers_with_strands_are_styled(hair, places):
    """Where sizes differ, only centers that strands need are styled; strands have the same bits as with all centers
    styled.
    """
    number = NumberMap(lambda roots, _ids, _clumps: 0.02 + 0.2 * np.abs(places(roots)))
    styling = hair.bound(clump.Settings(levels=2), inputs=Inputs(numbers={(0, "size"): number}))
    guides = styling.guides(hair.guides)
    weights = following.weights_now(hair.binding, guides)
    used = styling.used_centres
    assert all(len(rows) < len(level.binding.roots) for rows, level in zip(used, styling.levels, strict=True))
    found = following.strands_now(hair.binding, guides, weights, styling).numpy()
    styling.used_centres = None  # as for hair with locks of one size
    np.testing.assert_array_equal(found, following.strands_now(hair.binding, guides, weights, styling).numpy())


def test_another_crossover_has_the_same_sites(hair):
    """Trees that differ in their crossover share the bindings of their sites."""
    trees = [tree_settings(clump.Settings(size=0.07, crossover=crossover)) for crossover in (0.0, 0.3)]
    levels = [hair.trees.levels(tree) for tree in trees]
    assert levels[0] is levels[1]
    members = [hair.trees.members("hair", hair.binding, tree)[1] for tree in trees]
    assert 0.2 < (members[0] != members[1]).mean() < 0.4
