# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes and points on meshes satisfy their laws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hair_addon.core.errors import HairError
from hair_addon.core.geometry import mesh as mesh_math
from hair_addon.core.geometry.mesh import SurfacePoints, TriMesh, check_mesh, check_points
from hair_addon.core.geometry.sampling import sample_surface

CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
CUBE_QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def cube(diagonals):
    """Return the cube with each face split along a random diagonal."""
    triangles = []
    for (a, b, c, d), other in zip(CUBE_QUADS, diagonals, strict=True):
        triangles += [(a, b, c), (a, c, d)] if other else [(b, c, d), (b, d, a)]
    return TriMesh(CUBE, np.array(triangles, np.int32))


def test_areas_add_up_to_the_surface(sphere, square):
    np.testing.assert_allclose(square.areas.sum(), 1.0, rtol=1e-6)
    np.testing.assert_allclose(cube([True] * 6).areas.sum(), 24.0)
    assert 0.99 < sphere.areas.sum() / (4.0 * np.pi) < 1.0  # chords lie inside


@given(diagonals=st.lists(st.booleans(), min_size=6, max_size=6))
def test_vertex_normals_do_not_depend_on_the_triangulation(diagonals):
    normals = cube(diagonals).vertex_normals
    np.testing.assert_allclose(normals, CUBE / np.sqrt(3.0), atol=1e-6)


def test_smooth_normals_of_a_sphere_point_outwards(sphere):
    points = sample_surface(sphere, 500, seed=1)
    normals, positions = mesh_math.normals(sphere, points), mesh_math.positions(sphere, points)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-6)
    radial = positions / np.linalg.norm(positions, axis=1, keepdims=True)
    assert np.einsum("ni,ni->n", normals, radial).min() > np.cos(np.radians(3.0))  # its triangles: 6


def test_normals_are_unit_where_smooth_ones_cancel():
    """Normals have unit length where smooth ones cancel, as on a sheet of two sides: vertices have none, triangles
    do.
    """
    sheet = TriMesh(np.eye(3, dtype=np.float32), np.array([(0, 1, 2), (2, 1, 0)], np.int32))
    points = SurfacePoints(np.array([0, 1], np.int32), np.full((2, 3), 1.0 / 3.0, np.float32))
    normals = mesh_math.normals(sheet, points)
    np.testing.assert_allclose(normals, [[3**-0.5] * 3, [-(3**-0.5)] * 3], rtol=1e-6)


def test_interpolation_reproduces_linear_functions(head, rng):
    points = sample_surface(head, 1000, seed=2)
    direction = rng.normal(size=3)
    values = head.vertices @ direction + 0.5
    expected = mesh_math.positions(head, points) @ direction + 0.5
    np.testing.assert_allclose(mesh_math.interpolate(values, head, points), expected, atol=1e-6)


def test_triangles_without_area_keep_their_index():
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)], np.float32)
    mesh = TriMesh(vertices, np.array([(0, 0, 1), (0, 1, 3), (0, 1, 2), (1, 1, 1)], np.int32))
    check_mesh(mesh)
    np.testing.assert_array_equal(mesh.areas > 0.0, [False, False, True, False])
    assert np.isfinite(mesh.vertex_normals).all()
    np.testing.assert_allclose(mesh.vertex_normals[:3], [(0, 0, 1)] * 3)


@pytest.mark.parametrize(
    ("vertices", "triangles", "sentence"),
    [
        (np.zeros((3, 3)), np.zeros((0, 3)), "no faces"),
        (np.zeros((0, 3)), np.zeros((0, 3)), "no faces"),
        (np.eye(3), [(0, 1, 3)], "vertex 3"),
        (np.eye(3), [(0, 1, -1)], "vertex -1"),
        (np.diag([1.0, np.nan, 1.0]), [(0, 1, 2)], "1 of the surface's 3 vertices"),
        (np.diag([1.0, np.inf, -np.inf]), [(0, 1, 2)], "2 of the surface's 3 vertices"),
        (np.ones((3, 3)), [(0, 1, 2)], "zero area"),
        (np.eye(3), [(0, 0, 1), (2, 2, 2)], "zero area"),
        (1e20 * np.eye(3), [(0, 1, 2)], "scale"),
    ],
)
def test_refused_meshes(vertices, triangles, sentence):
    mesh = TriMesh(np.asarray(vertices, np.float32), np.asarray(triangles, np.int32).reshape(-1, 3))
    with pytest.raises(HairError, match=sentence):
        check_mesh(mesh)


@given(
    vertices=hnp.arrays(np.float32, (5, 3), elements=st.floats(width=32, allow_nan=True, allow_infinity=True)),
    triangles=hnp.arrays(np.int32, st.tuples(st.integers(0, 4), st.just(3)), elements=st.integers(-1, 5)),
)
@settings(max_examples=200)
def test_any_arrays_give_a_mesh_that_grows_or_a_sentence(vertices, triangles):
    mesh = TriMesh(vertices, triangles)
    try:
        check_mesh(mesh)
    except HairError:
        return
    points = sample_surface(mesh, 10, seed=0)
    assert np.all(mesh.areas[points.triangle] > 0.0)
    assert np.isfinite(mesh_math.positions(mesh, points)).all()
    np.testing.assert_allclose(np.linalg.norm(mesh_math.normals(mesh, points), axis=1), 1.0, rtol=1e-5)


@pytest.mark.parametrize(
    "points",
    [
        SurfacePoints(np.array([1280], np.int32), np.array([[1, 0, 0]], np.float32)),
        SurfacePoints(np.array([-1], np.int32), np.array([[1, 0, 0]], np.float32)),
        SurfacePoints(np.array([0], np.int32), np.array([[np.nan, 0, 0]], np.float32)),
        SurfacePoints(np.zeros(0, np.int32), np.zeros((0, 3), np.float32)),
    ],
)
def test_refused_points(sphere, points):
    with pytest.raises(HairError, match=r"(re)?generate (the )?guides"):
        check_points(sphere, points)
