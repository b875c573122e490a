# SPDX-License-Identifier: GPL-3.0-or-later
"""Random roots follow density × area, between triangles and inside them."""

import numpy as np
import pytest
from scipy.special import chdtrc

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.geometry.sampling import sample_surface

ONE_TRIANGLE = TriMesh(np.eye(3, dtype=np.float32), np.array([(0, 1, 2)], np.int32))


def assert_follows(counts, expected):
    """Assert by Pearson's test that a fair sample is this uneven more often than once in ten thousand times."""
    expected = expected * counts.sum() / expected.sum()
    assert chdtrc(len(counts) - 1, ((counts - expected) ** 2 / expected).sum()) > 1e-4


def test_points_are_on_the_surface(head):
    points = sample_surface(head, 5000, seed=1)
    assert points.triangle.dtype == np.int32 and points.barycentric.dtype == np.float32
    assert points.barycentric.min() >= 0.0
    np.testing.assert_allclose(points.barycentric.sum(axis=1), 1.0, atol=1e-6)


def test_uniform_roots_follow_area(head):
    """A hundred parts of the head of nearly equal area have nearly equal numbers of roots."""
    points = sample_surface(head, 100_000, seed=2)
    part = (np.cumsum(head.areas) / head.areas.sum() * 99.999).astype(int)
    assert_follows(np.bincount(part[points.triangle]), np.bincount(part, weights=head.areas))


def test_roots_follow_density_times_area(head, scalp):
    points = sample_surface(head, 100_000, seed=3, density=scalp)
    expected = head.areas * scalp[head.triangles].mean(axis=1)
    assert not np.any(np.bincount(points.triangle, minlength=len(expected))[expected == 0.0])
    part = (np.cumsum(expected) / expected.sum() * 99.999).astype(int)
    assert_follows(np.bincount(part[points.triangle]), np.bincount(part, weights=expected))


@pytest.mark.parametrize("density", [(1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.2, 0.0, 3.0)])
def test_density_is_linear_inside_a_triangle(density):
    """First and second moments of λ under a density Σ d λ: E λ_i = (D + d_i) / 4D, E λ_i² = (D + 2 d_i) / 10D."""
    points = sample_surface(ONE_TRIANGLE, 200_000, seed=4, density=np.array(density))
    d, total = np.array(density), sum(density)
    np.testing.assert_allclose(points.barycentric.mean(axis=0), (total + d) / (4 * total), atol=2e-3)
    np.testing.assert_allclose((points.barycentric**2).mean(axis=0), (total + 2 * d) / (10 * total), atol=2e-3)


def test_uniform_points_fill_a_triangle_evenly():
    """Uniform points fill a triangle evenly: a quarter of them is in each of the four triangles between edge
    midpoints.
    """
    points = sample_surface(ONE_TRIANGLE, 40_000, seed=5)
    quarters = np.append((points.barycentric > 0.5).sum(axis=0), (points.barycentric <= 0.5).all(axis=1).sum())
    assert_follows(quarters, np.ones(4))


def test_the_same_seed_gives_the_same_roots(head, scalp):
    first, again, other = (sample_surface(head, 100, seed=seed, density=scalp) for seed in (6, 6, 7))
    np.testing.assert_array_equal(first.barycentric, again.barycentric)
    np.testing.assert_array_equal(first.triangle, again.triangle)
    assert np.any(first.triangle != other.triangle)


def rows(points):
    return set(map(tuple, np.column_stack([points.triangle, points.barycentric])))


def test_more_roots_keep_those_that_are_there(head):
    few, many = sample_surface(head, 10, seed=8), sample_surface(head, 1000, seed=8)
    assert len(rows(few)) == 10 and rows(few) < rows(many)


def test_neighbours_on_the_surface_are_neighbours_in_memory(head, rng):
    """Neighbors on the surface are neighbors in memory, although the order of a mesh's triangles is arbitrary."""
    shuffled = TriMesh(head.vertices, rng.permutation(head.triangles))
    for mesh in (head, shuffled):
        points = mesh_math.positions(mesh, sample_surface(mesh, 20_000, seed=1))
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        at_random = np.linalg.norm(points[rng.permutation(20_000)] - points, axis=1)
        assert np.median(steps) < 0.05 * np.median(at_random)


def test_the_same_roots_on_every_machine(square):
    points = mesh_math.positions(square, sample_surface(square, 3, seed=1))
    expected = [(0.434404, 0.012106, 0.0), (0.623278, 0.109595, 0.0), (0.963656, 0.588075, 0.0)]
    np.testing.assert_allclose(points, expected, atol=1e-5)


def test_nothing_grows_on_triangles_without_area():
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)], np.float32)
    mesh = TriMesh(vertices, np.array([(0, 1, 3), (0, 1, 2), (3, 3, 3)], np.int32))
    np.testing.assert_array_equal(sample_surface(mesh, 1000, seed=1).triangle, 1)


@pytest.mark.parametrize(
    ("density", "sentence"),
    [
        (np.zeros(3), "zero everywhere"),
        (np.array([1.0, -0.5, np.nan]), "2 vertices is negative or not a number"),
        (np.array([1.0, np.inf, 1.0]), "1 vertices is negative or not a number"),
        (np.ones(4), "4 values for 3 vertices"),
        (np.ones((3, 1)), "one per vertex"),
    ],
)
def test_refused_densities(density, sentence):
    with pytest.raises(HairError, match=sentence):
        sample_surface(ONE_TRIANGLE, 10, seed=1, density=density)


@pytest.mark.parametrize("count", [0, -3])
def test_refused_counts(count):
    with pytest.raises(HairError, match="must be positive"):
        sample_surface(ONE_TRIANGLE, count, seed=1)
