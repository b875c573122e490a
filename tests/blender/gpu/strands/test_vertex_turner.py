# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations of vertices on the GPU equal those in double precision within single precision."""

import numpy as np
import pytest

from hair_addon.blender.gpu.strands import vertex_turner
from hair_addon.core.errors import HairError
from hair_addon.core.geometry import vertex_turns
from hair_addon.core.geometry.mesh import Faces
from tests.core.geometry.test_nearest_rotation import by_decomposition
from tests.core.geometry.test_surface_deform import deformations, faces_of, rotation
from tests.support.meshes import subdivided_sphere
from tests.support.pictures import glsl

CLOSE = 2e-6  # of axes, which are unit vectors


@pytest.fixture
def ball():
    """Return a closed unit ball."""
    return subdivided_sphere(2)


def nearest_rotations(matrices):
    """Return (N, 3, 3) rotations by the shader."""
    inputs = {f"c{column}": np.float32(matrices[:, :, column]) for column in range(3)}
    text, call = glsl.source("strands/nearest_rotation.glsl"), "nearest_rotation(mat3(c0, c1, c2))"
    return np.stack([glsl.evaluate(text, "vec3", f"{call}[{column}]", **inputs) for column in range(3)], axis=2)


def turned(turner, posed):
    """Return ((M, 3) places, (M,) whether they moved, (M, 2, 3) axes) of all vertices that turn."""
    texture = turner.turn(posed)
    texels = np.array(texture.read(), np.float32).reshape(-1, 3, 4)[: turner.turned_count]
    return texels[:, 0, :3], texels[:, 0, 3] > 0.0, texels[:, 1:, :3]


def test_rotations_are_polar_factors_of_any_scale(blender, rng):
    matrices = np.float32(rng.normal(size=(500, 3, 3)) * 10.0 ** rng.uniform(-9, 9, (500, 1, 1)))
    sizes = np.linalg.svd(matrices, compute_uv=False)
    matrices = matrices[(sizes[:, 1] > 0.02 * sizes[:, 0]) & (np.prod(sizes, axis=1) > 1e-5 * sizes[:, 0] ** 3)]
    matrices[:6] = [np.diag([1.0, 10.0**-n, 1.0]) for n in range(6)]
    matrices[6] = np.diag([1.0, -1.0, 1.0])
    assert len(matrices) > 400
    np.testing.assert_allclose(nearest_rotations(matrices), by_decomposition(matrices), rtol=0.0, atol=3e-5)
    near = matrices[: len(matrices) // 2] * 0.0 + np.eye(3, dtype=np.float32)
    near += 0.3 * np.float32(rng.uniform(-1.0, 1.0, near.shape))
    np.testing.assert_allclose(nearest_rotations(near), by_decomposition(near), rtol=0.0, atol=CLOSE)


def test_flat_matrices_have_rotations_that_are_as_near_as_any(blender, rng):
    flat = np.float32(rng.normal(size=(50, 3, 2))) @ np.float32(rng.normal(size=(50, 2, 3)))
    found = nearest_rotations(flat)
    np.testing.assert_allclose(found @ np.swapaxes(found, 1, 2), np.tile(np.eye(3), (50, 1, 1)), rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(np.linalg.det(found), 1.0, atol=1e-5)
    apart, least = (np.linalg.norm(flat - near, axis=(1, 2)) for near in (found, by_decomposition(flat)))
    np.testing.assert_allclose(apart, least, rtol=1e-4)
    np.testing.assert_array_equal(nearest_rotations(np.zeros((1, 3, 3))), np.eye(3)[None])


@pytest.mark.parametrize("kind", ["bend", "shear", "twist", "bulge"])
def test_turns_are_those_of_double_precision(blender, ball, rng, kind):
    """Rotations agree with double precision for a part of the vertices, far from the origin and on smooth surfaces."""
    faces, rest = faces_of(ball), ball.vertices
    after = deformations(rest)[kind] @ rotation(rng).T
    smooth = (rest * (1.0 + 0.01 * np.sin(9.0 * rest))).astype(np.float32)
    for at, far in ((rest, 0.0), (smooth, 0.0), (rest, 10.0)):
        for chosen in (None, rng.integers(0, len(rest), 40)):
            from_there, rooted, posed = (np.float32(one + far) for one in (at, rest, after))
            turning = vertex_turns.turning(from_there, faces, chosen)
            places, are_moved, axes = turned(vertex_turner.new_turner(turning, rooted), posed)
            np.testing.assert_array_equal(places, posed[turning.vertices])
            np.testing.assert_allclose(axes, turning.axes(posed), rtol=0.0, atol=CLOSE)
            assert are_moved.all()


def test_what_does_not_move_is_not_turned(blender, ball):
    faces, rest, posed = faces_of(ball), ball.vertices, ball.vertices.copy()
    posed[7] *= 1.2
    around = np.unique(ball.triangles[(ball.triangles == 7).any(axis=1)])
    turner = vertex_turner.new_turner(vertex_turns.turning(rest, faces), rest)
    places, are_moved, axes = turned(turner, posed)
    np.testing.assert_array_equal(np.flatnonzero(are_moved), around)
    still = ~are_moved
    np.testing.assert_array_equal(axes[still], np.tile(np.eye(3)[:2], (np.count_nonzero(still), 1, 1)))
    np.testing.assert_array_equal(places, posed)
    smooth = vertex_turner.new_turner(vertex_turns.turning(np.float32(1.1) * rest, faces), rest)
    _places, are_moved, axes = turned(smooth, None)  # at rest, on a surface that is smooth elsewhere
    assert not are_moved.any() and (axes == np.eye(3)[:2]).all()


def test_faces_without_area_and_vertices_without_faces_have_no_say(blender, ball, rng):
    turn = rotation(rng)
    triangles = np.concatenate([ball.triangles, [[0, 0, 1], [3, 3, 3]]]).astype(np.int32)
    starts = np.arange(0, triangles.size + 1, 3, dtype=np.int32)
    rest = np.concatenate([ball.vertices, np.float32([[2.0, 0.0, 0.0]])])
    posed = np.float32(rest @ turn.T)
    turner = vertex_turner.new_turner(vertex_turns.turning(rest, Faces(triangles.ravel(), starts)), rest)
    places, _are_moved, axes = turned(turner, posed)
    np.testing.assert_allclose(axes[:-1], np.tile(turn.T[:2], (len(rest) - 1, 1, 1)), rtol=0.0, atol=CLOSE)
    np.testing.assert_array_equal(axes[-1], np.eye(3)[:2])
    np.testing.assert_array_equal(places[-1], posed[-1])
    no_faces = vertex_turns.turning(rest, Faces(np.zeros(0, np.int32), np.zeros(1, np.int32)))
    for found in (no_faces.axes(posed), turned(vertex_turner.new_turner(no_faces, rest), posed)[2]):
        np.testing.assert_array_equal(found, np.tile(np.eye(3)[:2], (len(rest), 1, 1)))


def test_a_surface_that_collapses_has_finite_turns(blender, ball):
    turner = vertex_turner.new_turner(vertex_turns.turning(ball.vertices, faces_of(ball)), ball.vertices)
    for scale in ((1.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1e-12, 1e-12, 1e-12)):
        axes = turned(turner, np.float32(scale) * ball.vertices)[2]
        between = np.einsum("nac,nbc->nab", axes, axes)
        np.testing.assert_allclose(between, np.tile(np.eye(2), (len(axes), 1, 1)), atol=1e-4)


def test_another_mesh_is_refused(blender, ball):
    turning = vertex_turns.turning(ball.vertices, faces_of(ball))
    turner = vertex_turner.new_turner(turning, ball.vertices)
    for refused in (lambda: turner.turn(ball.vertices[1:]), lambda: turning.axes(ball.vertices[1:])):
        with pytest.raises(HairError, match="vertices"):
            refused()
    with pytest.raises(HairError, match="vertices"):
        vertex_turner.new_turner(turning, ball.vertices[1:])
    with pytest.raises(HairError, match="vertices"):
        vertex_turns.turning(ball.vertices, faces_of(ball), np.array([len(ball.vertices)]))
