# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations of a surface at its vertices, nearest to the mean deformation gradient of the faces around each.

A face's gradient maps two of its edges and its unit normal from rest to the present pose. The rest part is computed
once, for the vertices that are needed. shaders/strands/vertex_rotations.comp is the same in single precision.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.checks import require_count, require_indices
from ..kernels.parallel import Rows
from . import nearest_rotation
from .mesh import Faces

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

# A gradient takes a tenth of a microsecond: a thread for fewer faces is slower.
_LEAST_FACES = 32_768

UNTURNED = np.eye(3, dtype=np.float32)[:2]  # x and y axis of a vertex without rotation


@dataclass(frozen=True)
class VertexRotations:
    """Rest data of M vertices of a mesh and the F faces around them; created by `turning`."""

    rest: np.ndarray  # (V, 3) float32, all vertices at rest
    vertices: np.ndarray  # (M,) int32, ascending, the vertices with a rotation
    corners: np.ndarray  # (F, 3) int32, a face's first, second and last vertex
    inverses: np.ndarray  # (F, 3, 3) float64, of edges and normal at rest as columns; zero for faces of zero area
    starts: np.ndarray  # (M + 1,) int32, start of each vertex's faces in `around`
    around: np.ndarray  # (C,) int32, faces around each vertex, in the order of their corners

    @cached_property
    def needed(self) -> np.ndarray:
        """Vertices (N,) int32, ascending: the vertices with a rotation, and the vertices that affect one."""
        is_needed = np.zeros(len(self.rest), bool)
        is_needed[self.corners] = True
        is_needed[self.vertices] = True
        return np.flatnonzero(is_needed).astype(np.int32)

    def axes(self, after: np.ndarray) -> np.ndarray:
        """Return (M, 2, 3) float32: images of the x and the y axis at each vertex; unrotated where no face moves.

        after: (V, 3) float32, finite, all vertices in the present pose. Raises `HairError` if their number differs.
        """
        require_count("vertices", len(after), len(self.rest))
        face_count, vertex_count = len(self.corners), len(self.vertices)
        rest, after = _shared(self.rest, np.float32, wp.vec3), _shared(after, np.float32, wp.vec3)
        gradients = wp.empty(face_count, dtype=wp.mat33d, device="cpu")
        moves = wp.empty(face_count, dtype=wp.int32, device="cpu")
        of_face = [Rows(_shared(self.corners, np.int32, wp.vec3i)), Rows(_shared(self.inverses, float, wp.mat33d))]
        parallel.launch(
            _gradients, face_count, [*of_face, rest, after], [gradients, moves], "cpu", least_rows=_LEAST_FACES
        )
        axes = wp.empty((vertex_count, 2), dtype=wp.vec3, device="cpu")
        is_found = wp.empty(vertex_count, dtype=wp.int32, device="cpu")
        of_vertex = [Rows(_shared(part, np.int32, wp.int32)) for part in (self.starts[:-1], self.starts[1:])]
        shared = [_shared(self.around, np.int32, wp.int32), gradients, moves]
        parallel.launch(_vertex_axes, vertex_count, [*of_vertex, *shared], [axes, is_found], "cpu")
        found = axes.numpy()
        for vertex in np.flatnonzero(is_found.numpy() == 0):  # few, at flattened faces
            total = gradients.numpy()[self.around[self.starts[vertex] : self.starts[vertex + 1]]].sum(axis=0)
            found[vertex] = nearest_rotation.nearest_rotations(total[None])[0].T[:2]
        return found


def turning(rest: np.ndarray, faces: Faces, vertices: np.ndarray | None = None) -> VertexRotations:
    """Return the `VertexRotations` of a mesh with finite rest vertices (V, 3) float32.

    vertices: indices, in any shape, of vertices that need a rotation, None for all. Raises `HairError` for invalid
    indices.
    """
    vertex_count = len(rest)
    starts, around = faces.around(vertex_count)
    chosen = np.arange(vertex_count, dtype=np.int32)
    corners = faces.corner_vertices[np.stack([faces.starts[:-1], faces.starts[:-1] + 1, faces.starts[1:] - 1], axis=1)]
    if vertices is not None:
        require_indices("vertices", vertices, vertex_count)
        is_chosen = np.zeros(vertex_count, bool)
        is_chosen[vertices] = True
        chosen = np.flatnonzero(is_chosen).astype(np.int32)
        around = around[np.repeat(is_chosen, np.diff(starts))]
        starts = np.append(0, np.cumsum(np.diff(starts)[is_chosen])).astype(np.int32)
        some, around = np.unique(around, return_inverse=True)
        corners, around = corners[some], around.astype(np.int32)
    corners = np.ascontiguousarray(corners, np.int32)
    inverses = wp.empty(len(corners), dtype=wp.mat33d, device="cpu")
    inputs = [Rows(_shared(corners, np.int32, wp.vec3i)), _shared(rest, np.float32, wp.vec3)]
    parallel.launch(_rest_inverses, len(corners), inputs, [inverses], "cpu", least_rows=_LEAST_FACES)
    return VertexRotations(rest, chosen, corners, inverses.numpy().reshape(-1, 3, 3), starts, around)


def _shared(array, scalar, kind):
    return wp.array(np.ascontiguousarray(array, scalar), dtype=kind, device="cpu", copy=False)


@wp.func
def _basis(vertices: wp.array[wp.vec3], corners: wp.vec3i):
    """Return a matrix with columns: the edges from a face's first corner to the next and to the last, its normal."""
    first = wp.vec3d(vertices[corners[0]])
    along = wp.vec3d(vertices[corners[1]]) - first
    across = wp.vec3d(vertices[corners[2]]) - first
    normal = wp.cross(along, across)
    size = wp.length(normal)
    return wp.matrix_from_cols(along, across, normal / wp.where(size > wp.float64(0.0), size, wp.float64(1.0)))


@wp.kernel
def _rest_inverses(
    corners: wp.array[wp.vec3i],
    rest: wp.array[wp.vec3],
    # outputs
    out_inverses: wp.array[wp.mat33d],
):
    face = wp.tid()
    basis = _basis(rest, corners[face])
    inverse = wp.mat33d()
    if wp.abs(wp.determinant(basis)) > wp.float64(1e-30):
        inverse = wp.inverse(basis)
    out_inverses[face] = inverse


@wp.kernel
def _gradients(
    corners: wp.array[wp.vec3i],
    inverses: wp.array[wp.mat33d],
    rest: wp.array[wp.vec3],
    after: wp.array[wp.vec3],
    # outputs
    out_gradients: wp.array[wp.mat33d],
    out_moves: wp.array[wp.int32],
):
    """Compute each face's deformation gradient, zero for zero area, and whether any of its corners moves."""
    face = wp.tid()
    out_gradients[face] = _basis(after, corners[face]) * inverses[face]
    moves = int(0)
    for corner in range(3):
        vertex = corners[face][corner]
        if not rest[vertex] == after[vertex]:
            moves = 1
    out_moves[face] = moves


@wp.kernel
def _vertex_axes(
    firsts: wp.array[wp.int32],
    ends: wp.array[wp.int32],
    around: wp.array[wp.int32],
    gradients: wp.array[wp.mat33d],
    moves: wp.array[wp.int32],
    # outputs
    out_axes: wp.array2d[wp.vec3],
    out_is_found: wp.array[wp.int32],
):
    """Compute the rotation nearest to the mean around each vertex; the sum suffices, as scale does not matter."""
    vertex = wp.tid()
    total = wp.mat33d()
    is_moved = int(0)
    for index in range(firsts[vertex], ends[vertex]):
        face = around[index]
        total += gradients[face]
        is_moved += moves[face]
    out_axes[vertex, 0] = wp.vec3(1.0, 0.0, 0.0)
    out_axes[vertex, 1] = wp.vec3(0.0, 1.0, 0.0)
    out_is_found[vertex] = 1
    if is_moved > 0 and wp.ddot(total, total) > wp.float64(0.0):
        rotation, is_found = nearest_rotation.polar_factor(total)
        out_is_found[vertex] = is_found
        for axis in range(2):
            x, y, z = rotation[0, axis], rotation[1, axis], rotation[2, axis]
            out_axes[vertex, axis] = wp.vec3(float(x), float(y), float(z))
