# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights sum to one, are continuous in the root, and exclude separated guides."""

import math

import numpy as np
import pytest
import warp as wp

from hair_addon.core.interpolation import guide_weights
from hair_addon.core.interpolation.guide_weights import Limits
from tests.support.devices import DEVICE
from tests.support.strands.finding import find_guides


def vectors(array):
    return wp.array(np.float32(array), dtype=wp.vec3, device=DEVICE)


def up(count):
    return vectors(np.tile((0.0, 0.0, 1.0), (count, 1)))


def flat(places):
    """Return (N, 3) from (N, 2), with zeros."""
    return np.pad(np.asarray(places, float), [(0, 0), (0, 1)])


def dense(found, guide_count):
    """Return (S, G): the weight of each guide."""
    indices, weights = found.indices.numpy(), found.weights.numpy()
    full = np.zeros((len(indices), guide_count + 1))
    np.put_along_axis(full, np.where(indices >= 0, indices, guide_count), weights, axis=1)
    return full[:, :guide_count]


def weights_at(roots, guide_roots, distance=None, limit=8, **region_labels):
    """Return (S, G) weights on flat ground; roots (S, 2), guide_roots (G, 2)."""
    found = find_guides(
        vectors(flat(roots)),
        up(len(roots)),
        vectors(flat(guide_roots)),
        up(len(guide_roots)),
        distance,
        limit,
        **region_labels,
    )
    return dense(found, len(guide_roots))


def steepest(weights, path):
    """Return the largest change of all weights together per distance along a path."""
    return (np.abs(np.diff(weights, axis=0)).sum(axis=1) / np.linalg.norm(np.diff(path, axis=0), axis=1)).max()


@pytest.mark.parametrize("limit", [1, 3, 8, 12])
@pytest.mark.parametrize("distance", [None, 0.05, 0.2])
def test_weights_are_shares(rng, distance, limit):
    found = find_guides(
        vectors(flat(rng.random((300, 2)))), up(300), vectors(flat(rng.random((60, 2)))), up(60), distance, limit
    )
    indices, weights = found.indices.numpy(), found.weights.numpy()
    assert indices.shape == (300, limit)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert np.all((weights > 0.0) == (indices >= 0))
    assert np.all(np.diff(weights, axis=1) <= 0.0)  # nearest first
    np.testing.assert_allclose(np.linalg.norm(found.turns.numpy(), axis=-1), 1.0, atol=1e-6)


@pytest.mark.parametrize("distance", [None, 0.15, 0.4])
def test_weights_change_without_a_step(rng, distance):
    """Weights change without a step: along a path past random guides, changes shrink with the steps.

    Eq. 9 alone, cut off at d and behind the k-th guide, changes by a tenth at once: a slope of thousands.
    """
    guide_roots = rng.random((200, 2))
    along = np.linspace(0.1, 0.9, 40_001)
    path = np.stack([along, 0.5 + 0.2 * np.sin(9.0 * along)], axis=1)
    slopes = {every: steepest(weights_at(path[::every], guide_roots, distance), path[::every]) for every in (1, 10)}
    assert slopes[1] < 200.0  # guides are 0.07 apart
    assert slopes[1] < 1.5 * slopes[10]


def cut_off(roots, guide_roots, distance, limit):
    """Return (S, G) weights by Eq. 9 as printed, of the nearest guides within the distance."""
    apart = np.linalg.norm(roots[:, None] - guide_roots[None], axis=-1)
    w = np.exp(-(apart**2) / (0.5 * distance**2)) * (apart < distance) * (apart < np.sort(apart)[:, limit, None])
    return w / w.sum(axis=1, keepdims=True)


def test_the_equation_alone_has_steps(rng):
    """Eq. 9 alone has steps, which the test above detects."""
    guide_roots = rng.random((200, 2))
    along = np.linspace(0.1, 0.9, 40_001)
    path = np.stack([along, 0.5 + 0.2 * np.sin(9.0 * along)], axis=1)
    assert steepest(cut_off(path, guide_roots, 0.15, 8), path) > 2000.0


def test_weights_end_at_the_influence_distance_and_at_the_first_guide_left_out(rng):
    guide_roots, roots = rng.random((100, 2)), rng.random((400, 2))
    apart = np.linalg.norm(roots[:, None] - guide_roots[None], axis=-1)
    left_out = np.sort(apart, axis=1)[:, 8, None]
    for distance, reach in ((None, left_out), (0.12, np.minimum(0.12, left_out))):
        weights = weights_at(roots, guide_roots, distance)
        has_one = (apart < reach / 1.25).any(axis=1)
        assert has_one.sum() > 300
        assert np.all(weights[has_one][(apart < 0.999 * reach)[has_one]] > 0.0)
        assert np.all(weights[has_one][(apart > 1.0001 * reach)[has_one]] == 0.0)
        assert weights[(apart > 0.99 * reach) & has_one[:, None]].max() < 1e-3


def test_automatic_influence_is_local(rng):
    """Automatic influence is local: each root follows eight guides, also with one side ten times as dense."""
    guide_roots = np.concatenate([rng.random((1000, 2)), rng.random((100, 2)) + np.array([1.0, 0.0])])
    weights = weights_at(rng.random((500, 2)) * (2.0, 1.0), guide_roots)
    assert np.all((weights > 0.0).sum(axis=1) == 8)


@pytest.mark.parametrize("scale", [1e-4, 1e4])
def test_automatic_influence_has_no_scale(rng, scale):
    guide_roots, roots = rng.random((100, 2)), rng.random((50, 2))
    np.testing.assert_allclose(
        weights_at(scale * roots, scale * guide_roots), weights_at(roots, guide_roots), atol=1e-4
    )


@pytest.mark.parametrize("distance", [None, 1e-6, 0.05, 1e6])
@pytest.mark.parametrize("guide_roots", [[(3.0, 4.0)], [(3.0, 4.0)] * 3, [(3.0, 4.0)] * 12, [(0, 0), (1, 1)]])
def test_few_guides_or_many_in_one_place(guide_roots, distance):
    weights = weights_at([(3.0, 4.0), (3.0, 4.1), (5e4, 0.0)], guide_roots, distance)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)


@pytest.mark.parametrize("distance", [1e-6, 0.02])
def test_a_root_without_a_guide_in_reach_follows_the_nearest(rng, distance):
    """The strand follows the nearest guide, and guides at most a quarter farther away, so weights are continuous."""
    guide_roots, roots = rng.random((40, 2)), rng.random((300, 2))
    weights = weights_at(roots, guide_roots, distance)
    apart = np.linalg.norm(roots[:, None] - guide_roots[None], axis=-1)
    nearest = apart.min(axis=1, keepdims=True)
    alone = (apart <= 1.2501 * np.maximum(nearest, distance)).sum(axis=1) == 1
    assert alone.sum() > 100
    np.testing.assert_array_equal(weights[alone], apart[alone] == nearest[alone])
    assert np.all(weights[(apart > 1.2501 * np.maximum(nearest, distance))] == 0.0)


# ------------------------------------------------------------------------------------------------------ regions


def test_no_strand_mixes_regions(rng):
    guide_roots, roots = rng.random((150, 2)), rng.random((500, 2))
    guide_regions, strand_regions = (np.int32(3.0 * places[:, 0]) * 7 for places in (guide_roots, roots))
    weights = weights_at(roots, guide_roots, regions=(strand_regions, guide_regions))
    assert np.all(weights[strand_regions[:, None] != guide_regions] == 0.0)
    for region in (0, 7, 14):  # and in each it is as if there were no other
        its, own = strand_regions == region, guide_regions == region
        np.testing.assert_array_equal(weights[its][:, own], weights_at(roots[its], guide_roots[own]))


def test_a_region_without_guides_follows_another_one_but_no_two(rng):
    guide_roots, roots = rng.random((80, 2)), rng.random((400, 2))
    guide_regions = np.int32(guide_roots[:, 0] > 0.5)
    weights = weights_at(roots, guide_roots, regions=(np.full(400, -5, np.int32), guide_regions))
    in_one = weights[:, guide_regions == 1].sum(axis=1)
    assert np.all((in_one == 0.0) | (np.abs(in_one - 1.0) < 1e-6))
    assert 0.2 < (in_one > 0.5).mean() < 0.8


# ------------------------------------------------------------------------------------------------------ limits


def leaning(angles, lengths=1.0, point_count=9):
    """Return (G, P, 3): straight guides at the corners of a small polygon that lean towards X by angles (G,)."""
    angles = np.asarray(angles, float)
    around = np.linspace(0.0, 2.0 * np.pi, len(angles), endpoint=False)
    roots = 1e-3 * np.stack([np.cos(around), np.sin(around), np.zeros(len(angles))], axis=1)
    arms = np.stack([np.sin(angles), np.zeros(len(angles)), np.cos(angles)], axis=1) * np.reshape(lengths, (-1, 1))
    return roots[:, None] + np.linspace(0.0, 1.0, point_count)[:, None] * arms[:, None]


def limited_weights(guides, limits, root=(9e-4, 0.0)):
    """Return (G,) weights of a strand nearest to the first guide."""
    count = len(guides)
    found = find_guides(vectors(flat([root])), up(1), vectors(guides[:, 0]), up(count), None, max(count, 1))
    return dense(guide_weights.limited(found, vectors(guides), up(count), limits), count)[0]


def test_guides_beyond_the_angle_limit_have_no_share():
    angles = np.radians([0.0, 10.0, 29.0, 45.0, 61.0, 120.0])
    unlimited = limited_weights(leaning(angles), Limits())
    weights = limited_weights(leaning(angles), Limits(angle=math.radians(60.0)))
    assert weights.sum() == pytest.approx(1.0, abs=1e-6)
    assert np.all(weights[4:] == 0.0)
    ratios = weights / unlimited / (weights[0] / unlimited[0])
    np.testing.assert_allclose(ratios[:3], 1.0, rtol=1e-5)  # the first half of the limit is free
    assert 0.1 < ratios[3] < 0.9


def test_guides_beyond_the_length_limit_have_no_share():
    lengths = np.array([1.0, 1.5, 1.0 / 1.5, 2.5, 3.1, 0.3])
    unlimited = limited_weights(leaning(np.zeros(6), lengths), Limits())
    weights = limited_weights(leaning(np.zeros(6), lengths), Limits(length=3.0))
    assert weights.sum() == pytest.approx(1.0, abs=1e-6)
    assert np.all(weights[4:] == 0.0)
    ratios = weights / unlimited / (weights[0] / unlimited[0])
    np.testing.assert_allclose(ratios[:3], 1.0, rtol=1e-5)
    assert 0.1 < ratios[3] < 0.9


@pytest.mark.parametrize("limits", [Limits(angle=math.radians(60.0)), Limits(length=3.0)])
def test_shares_fade_while_a_guide_is_combed_away(limits):
    """The shares of a guide that is combed away fade without a step, whether it turns or grows."""
    shares = [
        limited_weights(leaning([0.0, turn], [1.0, 1.0 + 3.0 * turn]), limits, (1e-4, 0.0))[1]
        for turn in np.linspace(0.0, 1.5, 400)
    ]
    assert shares[0] > 0.1 and shares[-1] == 0.0
    assert np.abs(np.diff(shares)).max() < 0.02
    assert np.all(np.diff(shares) <= 1e-6)


def test_limits_of_no_effect(rng):
    """Limits have no effect on guides that are alike on a bending surface, and no limits mix all guides."""
    guides = rng.normal(size=(7, 9, 3))
    found = find_guides(vectors([(0, 0, 0)]), up(1), vectors(guides[:, 0]), up(7), None, 7)
    free = guide_weights.limited(found, vectors(guides), up(7), Limits())
    np.testing.assert_allclose(free.weights.numpy(), found.weights.numpy(), rtol=1e-5)
    normals = rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    grown = normals[:, None] * np.linspace(1.0, 1.5, 9)[:, None]  # along the normals of a sphere
    roots = vectors(normals[:20] + 1e-3)
    found = find_guides(roots, vectors(normals[:20]), vectors(normals), vectors(normals), None, 8)
    alike = guide_weights.limited(found, vectors(grown), vectors(normals), Limits(math.radians(20.0), 1.5))
    np.testing.assert_allclose(alike.weights.numpy(), found.weights.numpy(), rtol=1e-4)


@pytest.mark.parametrize("point_count", [1, 2, 3])
def test_limits_take_guides_of_few_points_or_no_length(point_count):
    guides = leaning([0.0, 0.0, 0.0], [1.0, 1.0, 0.0], point_count)
    weights = limited_weights(guides, Limits(math.radians(60.0), 3.0))
    assert weights.sum() == pytest.approx(1.0, abs=1e-6)
    assert point_count == 1 or weights[2] == 0.0
