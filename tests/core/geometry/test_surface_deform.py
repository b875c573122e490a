# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands on a deforming surface: rooted, rigid under rigid motion, and continuous between neighbors."""

import numpy as np
import pytest

from hair_addon.core.geometry import surface_deform
from hair_addon.core.geometry.mesh import Faces, interpolate
from hair_addon.core.geometry.sampling import sample_surface
from tests.support.meshes import flat_grid


def faces_of(mesh):
    """Return faces with every triangle as a polygon."""
    return Faces(mesh.triangles.ravel(), np.arange(0, mesh.triangles.size + 1, 3, dtype=np.int32))


def rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def strands_on(mesh, count, rng):
    """Return (points (count, 9, 3), root vertices, barycentric) of crooked strands whose first points are on the
    mesh.
    """
    roots = sample_surface(mesh, count, seed=1)
    points = interpolate(mesh.vertices, mesh, roots)[:, None] + rng.normal(size=(count, 9, 3)).astype(np.float32)
    points[:, 0] = interpolate(mesh.vertices, mesh, roots)
    return points, mesh.triangles[roots.triangle], roots.barycentric


def anywhere(strands, rng):
    """Return points that are no sum of a root and an offset, which a difference and a sum would restore by chance."""
    points, *roots = strands
    return rng.normal(size=points.shape).astype(np.float32), *roots


def carried(mesh, after, strands):
    after = after.astype(np.float32)
    motion = surface_deform.motion(mesh.vertices, after, faces_of(mesh))
    return surface_deform.carry(strands[0], motion, *strands[1:])


def test_a_surface_that_rests_moves_nothing(sphere, rng):
    strands = anywhere(strands_on(sphere, 300, rng), rng)
    np.testing.assert_array_equal(carried(sphere, sphere.vertices, strands), strands[0])


def test_strands_away_from_moved_vertices_keep_their_bits(sphere, rng):
    strands = anywhere(strands_on(sphere, 300, rng), rng)
    after = sphere.vertices.copy()
    after[0] *= 1.1
    around = np.isin(sphere.triangles, np.unique(sphere.triangles[(sphere.triangles == 0).any(axis=1)])).any(axis=1)
    near = np.isin(np.sort(strands[1], axis=1), np.sort(sphere.triangles[around], axis=1)).all(axis=1)
    moved = (carried(sphere, after, strands) != strands[0]).any(axis=(1, 2))
    assert moved.any() and not moved[~near].any()


def test_a_rigid_motion_moves_strands_rigidly(sphere, rng):
    strands = strands_on(sphere, 300, rng)
    turn, shift = rotation(rng), rng.normal(size=3)
    found = carried(sphere, sphere.vertices @ turn.T + shift, strands)
    np.testing.assert_allclose(found, strands[0] @ turn.T + shift, atol=1e-5)


@pytest.mark.parametrize("scale", [1e-3, 7.0])
def test_a_surface_that_grows_leaves_strands_as_long_and_unturned(sphere, rng, scale):
    strands = strands_on(sphere, 300, rng)
    found = carried(sphere, scale * sphere.vertices, strands)
    np.testing.assert_allclose(found - found[:, :1], strands[0] - strands[0][:, :1], atol=1e-5)


def test_some_vertices_turn_as_they_do_among_all(sphere, rng):
    """On triangles and quads, the corners of a few strands turn as among all."""
    after = (sphere.vertices * (1.0 + 0.3 * np.sin(3.0 * sphere.vertices[:, ::-1]))).astype(np.float32)
    triangles = faces_of(sphere)
    quads = Faces(triangles.corner_vertices[:3720], np.append(np.arange(0, 3720, 4), 3720).astype(np.int32))
    strands = strands_on(sphere, 7, rng)
    for faces in (triangles, quads):
        every, some = (surface_deform.motion(sphere.vertices, after, faces, v) for v in (None, strands[1]))
        np.testing.assert_array_equal(some.axes[strands[1]], every.axes[strands[1]])
        expected, found = (surface_deform.carry(strands[0], m, *strands[1:]) for m in (every, some))
        np.testing.assert_array_equal(found, expected)


def deformations(vertices):
    """Return a bend, a shear, a twist and a bulge, each far from rigid."""
    x, y, z = vertices.astype(np.float64).T
    return {
        "bend": np.stack([np.sin(x) * (1.0 + z), y, np.cos(x) * (1.0 + z)], axis=1),
        "shear": np.stack([x + 0.8 * y, y, z + 0.3 * x], axis=1),
        "twist": np.stack([x * np.cos(z) - y * np.sin(z), x * np.sin(z) + y * np.cos(z), z], axis=1),
        "bulge": np.stack([x, y, z + np.exp(-4.0 * (x**2 + y**2))], axis=1),
    }


@pytest.mark.parametrize("kind", ["bend", "shear", "twist", "bulge"])
def test_roots_stay_on_the_surface_and_strands_keep_their_shape(sphere, rng, kind):
    strands = strands_on(sphere, 300, rng)
    after = deformations(sphere.vertices)[kind].astype(np.float32)
    found = carried(sphere, after, strands)
    roots = np.einsum("nc,ncx->nx", strands[2], after[strands[1]])
    np.testing.assert_allclose(found[:, 0], roots, atol=1e-6)
    between = np.linalg.norm(strands[0][:, :, None] - strands[0][:, None], axis=-1)
    np.testing.assert_allclose(np.linalg.norm(found[:, :, None] - found[:, None], axis=-1), between, atol=1e-5)


def turns_along_a_line(square, after, count):
    """Return the largest turn [rad] between neighbors of strands close together along a line across a square."""
    place = np.linspace(0.05, 0.95, count)
    roots = [(x, 0.5 + 0.2 * (x - 0.5)) for x in place]
    # Cells of a grid of 16: the lower triangle of a cell is (corner, right, above), the upper (right, diagonal, above).
    vertices, barycentric = [], []
    for x, y in roots:
        column, row = int(16 * x), int(16 * y)
        u, v = 16 * x - column, 16 * y - row
        corner = row * 17 + column
        if u + v < 1.0:
            vertices.append((corner, corner + 1, corner + 17))
            barycentric.append((1.0 - u - v, u, v))
        else:
            vertices.append((corner + 1, corner + 18, corner + 17))
            barycentric.append((1.0 - v, u + v - 1.0, 1.0 - u))
    points = np.zeros((count, 3, 3), np.float32)
    points[:, :, :2] = np.array(roots)[:, None]
    points[:, 1, 0] += 1.0  # one arm along the surface, one across it
    points[:, 2, 2] += 1.0
    strands = points, np.array(vertices, np.int32), np.array(barycentric, np.float32)
    found = carried(square, after, strands)
    arms = found[:, 1:] - found[:, :1]
    return np.linalg.norm(np.diff(arms, axis=0), axis=-1).max()


@pytest.mark.parametrize("kind", ["bend", "shear", "twist", "bulge"])
def test_neighbours_never_jump(square, kind):
    """Neighbors never jump: ten times closer together, they turn apart ten times less, over every edge of the mesh."""
    after = deformations(square.vertices - [0.5, 0.5, 0.0])[kind]
    coarse, fine = (turns_along_a_line(square, after, count) for count in (1000, 10000))
    assert fine < 0.15 * coarse + 2e-6


def test_faces_without_area_have_no_say(rng):
    square = flat_grid(4)
    strands = strands_on(square, 50, rng)
    turn = rotation(rng)
    plain = carried(square, square.vertices @ turn.T, strands)
    doubled = np.array([[0, 0, 1], [3, 3, 3]], np.int32)
    triangles = np.concatenate([square.triangles, doubled])
    motion = surface_deform.motion(
        square.vertices,
        (square.vertices @ turn.T).astype(np.float32),
        Faces(triangles.ravel(), np.arange(0, triangles.size + 1, 3, dtype=np.int32)),
    )
    np.testing.assert_allclose(surface_deform.carry(strands[0], motion, *strands[1:]), plain, atol=1e-5)


def test_a_polygon_moves_like_its_triangles(rng):
    """A quad that is moved rigidly moves like its triangles, though its corners are listed from another one."""
    vertices = np.float32([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    turn = rotation(rng)
    faces = Faces(np.int32([2, 3, 0, 1]), np.int32([0, 4]))
    axes = surface_deform.motion(vertices, (vertices @ turn.T).astype(np.float32), faces).axes
    np.testing.assert_allclose(axes, np.broadcast_to(turn.T[:2], (4, 2, 3)), atol=1e-6)
