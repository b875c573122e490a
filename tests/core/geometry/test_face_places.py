# SPDX-License-Identifier: GPL-3.0-or-later
"""Places in polygons stay under another triangulation, and are found again after renumbering of vertices."""

import numpy as np
import pytest

from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.faces import face_places
from hair_addon.core.geometry.mesh import Faces, TriMesh, positions

# A square and a pentagon beside it, flat, so that no way to cut them moves a place.
VERTICES = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (2, -0.5), (2.5, 0.5), (2, 1.5)], np.float32)
FACES = Faces(np.array([0, 1, 2, 3, 1, 4, 5, 6, 2], np.int32), np.array([0, 4, 9], np.int32))
CUTS = (
    [(0, 1, 2), (0, 2, 3), (1, 4, 5), (1, 5, 6), (1, 6, 2)],
    [(0, 1, 3), (1, 2, 3), (4, 5, 6), (1, 4, 2), (4, 6, 2)],
)


def flat(places):
    return np.append(places, np.zeros((len(places), 1)), axis=1).astype(np.float32)


def mesh(cut):
    return TriMesh(flat(VERTICES), np.array(CUTS[cut], np.int32))


def rooted(rng, cut, count):
    """Return (polygons, vertices, weights) of random places in a mesh."""
    triangles = rng.integers(0, 5, count)
    return (
        face_places.owners(FACES)[triangles],
        np.array(CUTS[cut], np.int32)[triangles],
        rng.dirichlet((1, 1, 1), count),
    )


@pytest.mark.parametrize("cut", [0, 1])
def test_a_place_is_where_it_was_in_triangles_that_are_cut_as_before(rng, cut):
    polygons, vertices, weights = rooted(rng, cut, 200)
    points, are_none = face_places.on_triangles(mesh(cut), FACES, polygons, vertices, weights)
    assert not are_none.any()
    there = (weights[..., None] * flat(VERTICES)[vertices]).sum(axis=1)
    np.testing.assert_allclose(positions(mesh(cut), points), there, atol=1e-6)


def test_a_place_in_a_flat_face_stays_when_that_is_cut_otherwise(rng):
    polygons, vertices, weights = rooted(rng, 0, 300)
    points, _none = face_places.on_triangles(mesh(1), FACES, polygons, vertices, weights)
    there = (weights[..., None] * flat(VERTICES)[vertices]).sum(axis=1)
    np.testing.assert_allclose(positions(mesh(1), points), there, atol=1e-6)
    np.testing.assert_array_equal(face_places.owners(FACES)[points.triangle], polygons)
    back, _none = face_places.on_triangles(
        mesh(0), FACES, polygons, mesh(1).triangles[points.triangle], points.barycentric
    )
    np.testing.assert_allclose(positions(mesh(0), back), there, atol=1e-5)


QUAD = Faces(np.array([0, 1, 2, 3], np.int32), np.array([0, 4], np.int32))


def moved_in_quad(rng, corners, count=300):
    """Return places in one triangulation of a quad and in the other, (N, 3) each, and the `TriMesh` of the latter."""
    corners = np.array(corners, np.float32)
    cuts = [TriMesh(corners, np.array(cut[:2], np.int32)) for cut in CUTS]
    vertices, weights = cuts[0].triangles[rng.integers(0, 2, count)], rng.dirichlet((1, 1, 1), count)
    found, are_none = face_places.on_triangles(cuts[1], QUAD, np.zeros(count, np.int32), vertices, weights)
    assert not are_none.any()
    return (weights[..., None] * corners[vertices]).sum(axis=1), positions(cuts[1], found), cuts[1]


def test_a_place_in_a_bent_quad_moves_straight_up_or_down(rng):
    """A place in a bent quad moves straight up or down, by at most the distance of the diagonals, so neighbors stay
    apart.
    """
    before, after, _mesh = moved_in_quad(rng, [(0, 0, 0), (1.2, 0.1, 0.3), (1.4, 1.2, 0), (0.1, 0.5, 0.3)])
    np.testing.assert_allclose(after[:, :2], before[:, :2], atol=1e-6)
    assert 0.05 < abs(after - before).max() <= 0.3


def test_a_place_in_a_folded_quad_moves_to_the_nearest_point(rng):
    before, after, other = moved_in_quad(rng, [(0, 0, 0), (1, 0, 0), (0.2, 0.2, 0.1), (0, 1, 0)])
    nearest = positions(other, SurfaceQuery(other).nearest(before.astype(np.float32)))
    apart = [np.linalg.norm(there - before, axis=1) for there in (after, nearest)]
    np.testing.assert_allclose(*apart, atol=1e-5)
    assert apart[0].max() > 0.02


def test_a_vertex_that_is_no_corner_of_its_polygon_has_no_place():
    points, are_none = face_places.on_triangles(
        mesh(0), FACES, np.array([0, 1]), np.array([(0, 1, 5), (1, 4, 5)]), np.full((2, 3), 1 / 3)
    )
    np.testing.assert_array_equal(are_none, [True, False])
    assert len(points) == 2


def test_polygons_are_found_by_any_three_of_their_corners():
    asked = np.array([(3, 0, 2), (2, 4, 6), (0, 1, 4), (1, 2, 0), (-1, 1, 2)])
    np.testing.assert_array_equal(face_places.polygons_with(FACES, 7, asked), [0, 1, -1, 0, -1])


def test_vertices_that_stayed_are_known_wherever_they_went(rng):
    before = rng.random((50, 3), dtype=np.float32)
    order = rng.permutation(50)[:40]  # some are gone, the others in any order, among new ones
    after = np.concatenate([rng.random((7, 3), dtype=np.float32), before[order]])
    expected = np.full(50, -1)
    expected[order] = np.arange(7, 47)
    np.testing.assert_array_equal(face_places.matching_vertices(before, after), expected)


def test_vertices_that_moved_are_known_by_their_neighbors_where_none_came_or_went(rng):
    before = rng.random((60, 3), dtype=np.float32)
    after = np.delete(before, [40, 41], axis=0)
    after[5:20] += 1.0
    after[38:40] += 1.0  # beside those that are gone: which are left cannot be told
    after[[30, 31]] = after[30]  # became one place
    appended = np.concatenate([after, rng.random((9, 3), dtype=np.float32)])
    expected = np.where(np.arange(60) < 40, np.arange(60), np.arange(60) - 2)
    expected[38:42] = -1
    found = face_places.matching_vertices(before, appended)
    np.testing.assert_array_equal(found, expected)
    assert (face_places.matching_vertices(before, appended[:0]) == -1).all()
    assert len(face_places.matching_vertices(before[:0], before)) == 0


def test_doubled_vertices_are_told_apart_by_their_order(rng):
    one = rng.random((6, 3), dtype=np.float32)
    before = np.concatenate([one, one])
    np.testing.assert_array_equal(
        face_places.matching_vertices(before, before[::-1]), [*range(5, -1, -1), *range(11, 5, -1)]
    )
