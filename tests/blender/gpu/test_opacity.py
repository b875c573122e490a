# SPDX-License-Identifier: GPL-3.0-or-later
"""Deep opacity maps count the strands in front of a place and give the light that they transmit:
shadows/opacity.glsl.
"""

import numpy as np
import pytest

from tests.support.pictures import glsl

LAYER_ENDS = np.array([0.007, 0.058, 0.205, 0.5])  # as in shadows/opacity.glsl, which the next test holds them to


def opacity(expression, returns="float", **inputs):
    return glsl.evaluate(glsl.source("shadows/opacity.glsl"), returns, expression, **inputs)


@pytest.fixture
def stack(rng):
    """Return the depths of 500 strands behind the first, and the four counts that they leave in a texel."""
    depths = np.concatenate([[0.0], rng.random(499) ** 3 * 1.2]).astype(np.float32)
    return depths, counts_of(depths)


def counts_of(depths):
    layers = opacity("float(layer_of(depth))", depth=depths).astype(int)
    return np.bincount(layers, minlength=4).cumsum().astype(np.float32)


def strands_in_front(counts, depths, back=1.2, own=0.0):
    depths = np.asarray(depths, np.float32)
    counts = np.broadcast_to(np.float32(counts), (len(depths), 4))
    back, own = (np.full(len(depths), one, np.float32) for one in (back, own))
    return opacity("strands_in_front(counts, depth, back, own)", counts=counts, depth=depths, back=back, own=own)


def test_strands_in_front_are_exact_where_layers_end(stack):
    depths, counts = stack
    ends = opacity("LAYER_ENDS", "vec4", depth=depths)[0]
    np.testing.assert_allclose(ends, LAYER_ENDS, rtol=1e-6)
    expected = [np.count_nonzero(depths <= end) for end in ends[:3]] + [len(depths)]
    found = strands_in_front(counts, [*ends[:3], depths.max()], depths.max())
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_no_strand_is_in_front_of_the_first_and_all_are_in_front_of_the_last(stack):
    depths, counts = stack
    front = strands_in_front(counts, np.linspace(0.0, 1.5, 301))
    assert front[0] == 0.0
    assert (np.diff(front) >= -1e-3).all()
    np.testing.assert_allclose(front[241:], len(depths), rtol=1e-5)


@pytest.mark.parametrize("back", [0.003, 0.03, 0.12, 0.5, 1.1])
def test_an_even_medium_is_counted_exactly(back):
    depths = np.linspace(0.0, back, 2001)
    assert np.abs(strands_in_front(counts_of(depths), depths, back) - 2000.0 * depths / back).max() < 2.0


def test_a_strand_is_not_in_front_of_itself(stack):
    depths, counts = stack
    more = depths[1:]
    own = np.eye(4, dtype=np.float32)[opacity("float(layer_of(depth))", depth=more).astype(int)].cumsum(axis=1)
    without = strands_in_front(counts, more)
    np.testing.assert_allclose(strands_in_front(counts + own, more, own=1.0), without, rtol=1e-4)


def test_strands_that_surfaces_hide_are_counted_behind_all_others():
    back, hidden = 0.1, 0.11
    depths = np.linspace(0.0, 1.0, 101)
    ends = np.tile(np.array([0.0, back], np.float32), (101, 1))
    layers = opacity("float(layer_among(depth, ends, hidden))", depth=depths, ends=ends, hidden=np.full(101, hidden))
    kept = depths <= hidden
    assert layers[~kept].min() > layers[kept].max()


def test_transmitted_light_is_the_mean_over_a_random_number_of_strands():
    means, forward = (grid.ravel() for grid in np.meshgrid([0.0, 0.1, 1.0, 7.0, 30.0], [0.0, 0.2, 0.9, 1.0]))
    strands = np.arange(1, 200)
    later = np.cumprod(means[:, None] / strands, axis=1)  # of Poisson's probabilities, by the first
    expected = np.exp(-means) * (1.0 + np.sum(later * forward[:, None] ** strands, axis=1))
    shader = opacity("transmitted(mean, vec3(forward)).g", mean=means, forward=forward)
    np.testing.assert_allclose(shader, expected, rtol=1e-6, atol=1e-6)


# Wetness
