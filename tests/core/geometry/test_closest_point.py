# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest point of a surface is that of brute force."""

import numpy as np
import pytest

from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.mesh import TriMesh, positions


def brute_force_distance(mesh, triangles, place):
    """Return the distance [m] from a place to the nearest triangle, to its plane inside and else to its edges."""
    best = np.inf
    for corners in mesh.vertices[mesh.triangles[triangles]].astype(float):
        a, b, c = corners
        normal = np.cross(b - a, c - a)
        flat = place - normal * ((place - a) @ normal) / (normal @ normal)
        if all(np.cross(q - p, flat - p) @ normal >= 0.0 for p, q in ((a, b), (b, c), (c, a))):
            best = min(best, np.linalg.norm(place - flat))
        for p, q in ((a, b), (b, c), (c, a)):
            along = np.clip((place - p) @ (q - p) / ((q - p) @ (q - p)), 0.0, 1.0)
            best = min(best, np.linalg.norm(place - (p + along * (q - p))))
    return best


@pytest.fixture
def soup(rng):
    """Return 40 random triangles, every fourth without an area."""
    vertices = rng.random((120, 3)).astype(np.float32)
    triangles = np.arange(120, dtype=np.int32).reshape(40, 3)
    triangles[::4, 2] = triangles[::4, 1]
    return TriMesh(vertices, triangles)


def test_nearest_points_equal_brute_force(soup, rng, device):
    places = 2.0 * rng.random((60, 3)) - 0.5
    found = SurfaceQuery(soup, device=device).nearest(places)
    solid = np.flatnonzero(soup.areas > 0.0)
    assert np.isin(found.triangle, solid).all()
    distances = np.linalg.norm(positions(soup, found) - places, axis=1)
    expected = [brute_force_distance(soup, solid, place) for place in places]
    np.testing.assert_allclose(distances, expected, atol=1e-6)


def test_only_chosen_triangles_answer(soup, rng, device):
    chosen = np.array([1, 2, 3, 30])
    places = rng.random((50, 3))
    found = SurfaceQuery(soup, chosen, device).nearest(places)
    assert set(found.triangle) <= set(chosen)
    distances = np.linalg.norm(positions(soup, found) - places, axis=1)
    np.testing.assert_allclose(distances, [brute_force_distance(soup, chosen, p) for p in places], atol=1e-6)
