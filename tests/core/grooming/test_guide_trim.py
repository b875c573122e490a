# SPDX-License-Identifier: GPL-3.0-or-later
"""Trimmed guides end on the cutter, and the rest of them does not change."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.mesh import TriMesh, positions
from hair_addon.core.grooming.guide_trim import SHORTEST, mesh_crossings, plane_crossings, trimmed
from tests.support.meshes import flat_grid, subdivided_sphere
from tests.support.strands.combed import distance_to_polylines, lengths, standing, wavy


def a_plane(rng):
    normal = rng.normal(size=3)
    return np.array([0.05, -0.02, 0.1]), normal / np.linalg.norm(normal)


def test_a_plane_cuts_at_the_first_crossing(rng):
    points = wavy(rng, 200)
    origin, normal = a_plane(rng)
    before = (points.astype(np.float64) - origin) @ normal
    changed = trimmed(points, plane_crossings(points, origin, normal), np.ones(200))
    after = (changed.astype(np.float64) - origin) @ normal
    is_rooted_there = before[:, 0] > 0.0
    is_cut = ~is_rooted_there & (before.max(axis=1) > 0.0)
    assert min(is_cut.sum(), is_rooted_there.sum(), (~is_cut & ~is_rooted_there).sum()) > 3
    assert np.array_equal(changed[~is_cut], points[~is_cut])
    far = is_cut & (lengths(changed) > 2.0 * SHORTEST * lengths(points))
    assert after[far].max() < 1e-6
    np.testing.assert_allclose(after[far, -1], 0.0, atol=1e-6)
    assert distance_to_polylines(changed, points).max() < 1e-6
    assert np.array_equal(changed[:, 0], points[:, 0])


def test_trimming_twice_is_trimming_once(rng):
    points = wavy(rng, 200)
    origin, normal = a_plane(rng)
    once = trimmed(points, plane_crossings(points, origin, normal), np.ones(200))
    twice = trimmed(once, plane_crossings(once, origin, normal), np.ones(200))
    np.testing.assert_allclose(lengths(twice), lengths(once), rtol=1e-3)


def test_a_mesh_cuts_as_the_plane_it_lies_in(rng):
    points = wavy(rng, 200)
    floor = flat_grid(3, size=10.0)
    floor = TriMesh(floor.vertices - np.float32([5.0, 5.0, -0.1]), floor.triangles)
    by_mesh = mesh_crossings(points, floor)
    up, down = (plane_crossings(points, [0.0, 0.0, 0.1], [0.0, 0.0, sign]) for sign in (1.0, -1.0))
    by_plane = np.minimum(up, down)
    assert 10 < np.isfinite(by_plane).sum() < 190
    np.testing.assert_allclose(by_mesh, by_plane, rtol=1e-4, atol=1e-6)


def test_hair_in_a_larger_sphere_ends_on_it(rng):
    """Hair in a larger sphere ends on it, and no guide is cut by its own surface."""
    inner, outer = subdivided_sphere(3), subdivided_sphere(4, radius=1.1)
    points, _roots, _normals = standing(inner, 100, rng)
    changed = trimmed(points, mesh_crossings(points, outer), np.ones(100))
    on_outer = positions(outer, SurfaceQuery(outer).nearest(changed[:, -1]))
    np.testing.assert_allclose(changed[:, -1], on_outer, atol=2e-6)
    assert np.isinf(mesh_crossings(changed * np.float32(0.99), outer)).all()


def test_half_a_weight_leaves_half_of_what_is_beyond(rng):
    points = wavy(rng)
    full = lengths(points)
    changed = trimmed(points, 0.4 * full, np.full(len(points), 0.5))
    assert distance_to_polylines(changed[:, -1:], points).max() < 1e-6
    tips = trimmed(points, 0.7 * full, np.ones(len(points)))
    np.testing.assert_allclose(changed, tips, atol=1e-6)


def test_something_is_left_of_every_guide(rng):
    points = wavy(rng)
    changed = trimmed(points, np.zeros(len(points)), np.ones(len(points)))
    assert (lengths(changed) > 0.0).all()
    assert np.array_equal(trimmed(points, np.full(30, np.inf), np.ones(30)), points)


def test_a_mesh_without_faces_is_refused(rng):
    with pytest.raises(HairError, match="no faces"):
        mesh_crossings(wavy(rng), TriMesh(np.zeros((3, 3), np.float32), np.zeros((0, 3), np.int32)))
