# SPDX-License-Identifier: GPL-3.0-or-later
"""A point belongs to the region with the largest weight, and any difference separates."""

import numpy as np

from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.mesh import SurfacePoints
from hair_addon.core.geometry.sampling import sample_surface
from hair_addon.core.interpolation.regions import Regions, region_labels, regions_at


def test_two_regions_of_vertices_meet_halfway(square, rng):
    """Two regions of vertices meet halfway, where their interpolated indicators pass one half."""
    labels = rng.choice([-4, 9], len(square.vertices)).astype(np.int32)
    points = sample_surface(square, 2000, 1)
    share = mesh_math.interpolate(labels == 9, square, points)
    clear = np.abs(share - 0.5) > 1e-6
    found = regions_at(labels[square.triangles], points)
    np.testing.assert_array_equal(found[clear], np.where(share > 0.5, 9, -4)[clear])


def test_a_face_is_one_region(square, rng):
    labels = rng.integers(0, 5, len(square.triangles)).astype(np.int32)
    points = sample_surface(square, 500, 1)
    np.testing.assert_array_equal(regions_at(np.repeat(labels[:, None], 3, axis=1), points), labels[points.triangle])


def test_three_regions_at_a_triangle_are_those_of_the_nearest_corner():
    corners = np.array([[5, 6, 7]], np.int32)
    points = SurfacePoints(np.zeros(3, np.int32), np.float32([[0.5, 0.3, 0.2], [0.2, 0.45, 0.35], [0.1, 0.2, 0.7]]))
    np.testing.assert_array_equal(regions_at(corners, points), [5, 6, 7])


def test_kept_apart_is_what_differs_in_any(square, rng):
    """Points have the same label if and only if all their regions are alike; in a region without guides it is -1."""
    roots, guide_roots = sample_surface(square, 300, 1), sample_surface(square, 40, 2)
    some, others = (rng.integers(-(2**31), 2**31 - 1, 3).astype(np.int32) for _ in range(2))
    first = np.repeat(some[rng.integers(0, 3, len(square.triangles))][:, None], 3, axis=1)
    second = others[rng.integers(0, 3, len(square.vertices))][square.triangles]
    own = rng.integers(0, 2, 40).astype(np.int32)
    strands, guides = region_labels((Regions(first), Regions(second)), roots, guide_roots)
    of_strands, of_guides = (np.stack([regions_at(c, p) for c in (first, second)], 1) for p in (roots, guide_roots))
    alike = (of_strands[:, None] == of_guides).all(axis=2)
    np.testing.assert_array_equal(strands[:, None] == guides, alike)
    np.testing.assert_array_equal(strands == -1, ~alike.any(axis=1))
    strands, guides = region_labels((Regions(None, own),), roots, guide_roots)
    assert np.all(strands == -1)
    np.testing.assert_array_equal(guides[:, None] == guides, own[:, None] == own)


def test_no_regions_keep_nothing_apart(square):
    points = sample_surface(square, 5, 1)
    assert region_labels((), points, points) is None


def test_empty_regions_keep_nothing_apart(square):
    points = sample_surface(square, 5, 1)
    strands, guides = region_labels((Regions(),), points, points)
    assert np.all(strands[:, None] == guides)
