# SPDX-License-Identifier: GPL-3.0-or-later
"""Neighbours found by the grid equal those by brute force."""

import numpy as np
import pytest
import warp as wp
from hypothesis import assume, given
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.search import hash_grid
from tests.support.devices import DEVICE


def found(points, queries, distance, limit, device=DEVICE):
    """Return what `neighbours` returns, as NumPy arrays."""
    points, queries = (wp.array(np.float32(a), dtype=wp.vec3, device=device) for a in (points, queries))
    return [a.numpy() for a in hash_grid.neighbours(points, queries, distance, limit)]


def assert_equal_to_brute_force(points, queries, distance, limit):
    """Assert that rows are the nearest points within the distance, or the nearest points of all, in order, up to
    rounding.
    """
    indices, distances = found(points, queries, distance, limit)
    apart = np.linalg.norm(np.float32(queries)[:, None] - np.float32(points)[None], axis=-1)
    nearest = np.pad(np.sort(apart, axis=1), [(0, 0), (0, limit)], constant_values=np.inf)[:, :limit]
    nearest[:, 1:][nearest[:, 1:] >= distance] = np.inf
    np.testing.assert_allclose(distances, nearest, rtol=1e-5)
    np.testing.assert_array_equal(indices >= 0, np.isfinite(nearest))
    row, slot = np.nonzero(indices >= 0)
    np.testing.assert_allclose(apart[row, indices[row, slot]], distances[row, slot], rtol=1e-5)
    assert all(len(np.unique(known)) == len(known) for known in (row[row >= 0] for row in indices))


@given(
    seed=st.integers(0, 2**32 - 1),
    point_count=st.integers(1, 80),
    limit=st.integers(1, hash_grid.LIMIT),
    reach=st.floats(-3.0, 2.0),
    scale=st.integers(-6, 6),
)
def test_neighbours_equal_brute_force(seed, point_count, limit, reach, scale):
    """Neighbors equal brute force, for distances from 0.001 to 100 times the extent, from micrometers to megameters."""
    generator = np.random.default_rng(seed)
    points = 10.0**scale * generator.random((point_count, 3))
    queries = 10.0**scale * (1.4 * generator.random((30, 3)) - 0.2)
    distance = 10.0 ** (scale + reach)
    apart = np.linalg.norm(queries[:, None] - points[None], axis=-1)
    assume(np.abs(apart / distance - 1.0).min() > 1e-5)  # within or beyond must not hang on rounding
    assert_equal_to_brute_force(points, queries, distance, limit)


def test_evenly_spread_points_on_a_surface(rng):
    """Evenly spread points on a surface, the usual case, have the right neighbors although separate cells share
    buckets.
    """
    points, queries = (rng.normal(size=(count, 3)) for count in (4000, 1000))
    points, queries = (a / np.linalg.norm(a, axis=1, keepdims=True) for a in (points, queries))
    assert_equal_to_brute_force(points, queries, 0.09, 8)


def test_a_query_far_from_all_points_finds_the_nearest(rng):
    points = rng.random((200, 3))
    queries = np.concatenate([points * 1000.0, -1e4 * points, points + np.array([0.0, 0.0, 30.0])])
    assert_equal_to_brute_force(points, queries, 0.01, 4)


def test_two_far_clusters(rng):
    points = np.concatenate([0.001 * rng.random((50, 3)), 100.0 + 0.001 * rng.random((50, 3))])
    assert_equal_to_brute_force(points, points, 0.0005, 8)


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (3.0, -4.0, 5.0)])
def test_points_in_one_place_come_in_their_order(place):
    indices, distances = found(np.tile(place, (20, 1)), [place], 0.1, 8)
    np.testing.assert_array_equal(indices, [range(8)])
    np.testing.assert_array_equal(distances, np.zeros((1, 8)))


def test_mirrored_points_come_in_their_order():
    """Mirrored points with equal distances are in the order of their indices, on every machine."""
    points = [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    indices, _ = found(points, [(0, 0, 0)], 2.0, 4)
    np.testing.assert_array_equal(indices, [range(4)])


def test_far_from_the_origin(rng):
    points = np.float32(rng.random((300, 3)) + 1000.0)
    assert_equal_to_brute_force(points, points, 0.2, 6)


@pytest.mark.parametrize("distance", [0.0, -1.0, np.nan, np.inf, -np.inf])
def test_refused_distances(distance):
    with pytest.raises(HairError, match="positive and finite"):
        found(np.eye(3), np.eye(3), distance, 3)


def test_no_points_are_refused():
    with pytest.raises(HairError, match="no guides"):
        found(np.zeros((0, 3)), np.eye(3), 1.0, 3)


@pytest.mark.parametrize("cluster", [0.02, 1.0])  # so close that a cell of queries has more near it than it may list
def test_cells_of_queries_and_single_ones_find_the_same(rng, monkeypatch, cluster):
    points, queries = cluster * rng.random((600, 3)), rng.random((5000, 3))
    points[0] = 1.0
    together = found(points, queries, 0.3, 8, "cpu")
    monkeypatch.setattr(hash_grid, "by_cells", hash_grid.by_queries)
    for one, other in zip(together, found(points, queries, 0.3, 8, "cpu"), strict=True):
        np.testing.assert_array_equal(one, other)


def test_no_more_than_a_row_holds():
    with pytest.raises(ValueError, match=f"at most {hash_grid.LIMIT}"):
        found(np.eye(3), np.eye(3), 1.0, hash_grid.LIMIT + 1)
