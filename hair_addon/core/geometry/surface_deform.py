# SPDX-License-Identifier: GPL-3.0-or-later
"""Deformation of strands with their surface, by rotations that are continuous over the surface.

A face's deformation gradient takes two of its edges and its unit normal to where they are now. The mean over the faces
around a vertex has a nearest rotation, its polar factor U V^T of the singular value decomposition [Higham86]; between
vertices two of its columns are interpolated and made orthonormal again. So rigid motion is reproduced exactly, shear
and stretch rotate no more than necessary, and neighbouring roots do not separate, as they do with the frames of single
triangles or of a UV map. blender/data/strands/follow_nodes.py implements the same in geometry nodes.

A subdivided surface is smooth where it is now, and flat on the faces of its cage before: from there, neighbouring roots
would turn apart. Its rotation is that from the cage's smooth surface (smooth_surface.py).
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ..kernels import kernel_cache, parallel
from ..kernels.checks import require_count, require_indices
from ..kernels.parallel import Rows
from . import nearest_rotation
from .mesh import Faces, require_finite

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


# Gradients take a tenth of a microsecond each: fewer are not worth a thread.
_LEAST_FACES = 32_768


@dataclass(frozen=True)
class SurfaceMotion:
    """Positions of a mesh's vertices before and after, (V, 3) float32, and the rotation of the surface there.

    axes: (V, 2, 3) float32, where the rotation at each vertex takes the x and the y axis.
    """

    before: np.ndarray
    after: np.ndarray
    axes: np.ndarray


def motion(
    before: np.ndarray,
    after: np.ndarray,
    faces: Faces,
    vertices: np.ndarray | None = None,
    smooth_before: np.ndarray | None = None,
) -> SurfaceMotion:
    """The `SurfaceMotion` of vertices (V, 3) that went from `before` to `after`; faces: the mesh's `Faces`.

    vertices: indices, in any shape, of those whose rotation matters, of a large mesh perhaps few; None for all;
    smooth_before: (V, 3) of the smooth surface that they were on, from which the surface turns; None for `before`.
    Raises `HairError` where vertices are not finite numbers: no rotation could be found for them.
    """
    require_finite(before)
    require_finite(after)
    faces = faces if vertices is None else _around(faces, vertices, len(before))
    return SurfaceMotion(before, after, vertex_axes(before if smooth_before is None else smooth_before, after, faces))


def _around(faces, vertices, vertex_count):
    """The `Faces` that some vertices are corners of."""
    is_asked = np.zeros(vertex_count, bool)
    is_asked[vertices] = True
    chosen = np.logical_or.reduceat(is_asked[faces.corner_vertices], faces.starts[:-1])
    sizes = np.diff(faces.starts)
    starts = np.append(0, np.cumsum(sizes[chosen]))
    return Faces(faces.corner_vertices[np.repeat(chosen, sizes)], starts)


def vertex_axes(before: np.ndarray, after: np.ndarray, faces: Faces) -> np.ndarray:
    """(V, 2, 3) float32: where the rotation at each vertex takes the x and the y axis; unturned where no face is."""
    vertex_count = len(before)
    require_count("vertices", len(after), vertex_count)
    starts, around = faces.around(vertex_count)
    before, after = _shared(before, np.float32, wp.vec3), _shared(after, np.float32, wp.vec3)
    face_count = len(faces.starts) - 1
    gradients = wp.empty(face_count, dtype=wp.mat33d, device="cpu")
    moves = wp.empty(face_count, dtype=wp.int32, device="cpu")
    corners = _shared(faces.corner_vertices, np.int32, wp.int32)
    of_face = [Rows(_shared(part, np.int32, wp.int32)) for part in (faces.starts[:-1], faces.starts[1:])]
    given = [*of_face, corners, before, after]
    parallel.launch(_face_gradients, face_count, given, [gradients, moves], "cpu", least_rows=_LEAST_FACES)
    axes = wp.empty((vertex_count, 2), dtype=wp.vec3, device="cpu")
    is_found = wp.empty(vertex_count, dtype=wp.int32, device="cpu")
    of_vertex = [Rows(_shared(part, np.int32, wp.int32)) for part in (starts[:-1], starts[1:])]
    shared = [_shared(around, np.int32, wp.int32), gradients, moves]
    parallel.launch(_vertex_axes, vertex_count, [*of_vertex, *shared], [axes, is_found], "cpu")
    found = axes.numpy()
    for vertex in np.flatnonzero(is_found.numpy() == 0):  # flattened: few
        total = gradients.numpy()[around[starts[vertex] : starts[vertex + 1]]].sum(axis=0)
        found[vertex] = nearest_rotation.nearest_rotations(total[None])[0].T[:2]
    return found


def _shared(array, scalar, kind):
    return wp.array(np.ascontiguousarray(array, scalar), dtype=kind, device="cpu", copy=False)


@wp.func
def _basis(vertices: wp.array[wp.vec3], corners: wp.vec3i):
    """Columns are the edges from a face's first corner to the next and to the last, and its normal."""
    first = wp.vec3d(vertices[corners[0]])
    along = wp.vec3d(vertices[corners[1]]) - first
    across = wp.vec3d(vertices[corners[2]]) - first
    normal = wp.cross(along, across)
    size = wp.length(normal)
    return wp.matrix_from_cols(along, across, normal / wp.where(size > wp.float64(0.0), size, wp.float64(1.0)))


@wp.kernel
def _face_gradients(
    firsts: wp.array[wp.int32],
    ends: wp.array[wp.int32],
    corner_vertices: wp.array[wp.int32],
    before: wp.array[wp.vec3],
    after: wp.array[wp.vec3],
    # outputs
    out_gradients: wp.array[wp.mat33d],
    out_moves: wp.array[wp.int32],
):
    """Of each face's deformation the gradient, zero of faces without area, and whether any of its corners moves."""
    face = wp.tid()
    first, end = firsts[face], ends[face]
    corners = wp.vec3i(corner_vertices[first], corner_vertices[first + 1], corner_vertices[end - 1])
    was = _basis(before, corners)
    gradient = wp.mat33d()
    if wp.abs(wp.determinant(was)) > wp.float64(1e-30):
        gradient = _basis(after, corners) * wp.inverse(was)
    out_gradients[face] = gradient
    moves = int(0)
    for corner in range(first, end):
        vertex = corner_vertices[corner]
        if not before[vertex] == after[vertex]:
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
    """Rotations nearest to the mean around each vertex, without normalisation, which they ignore."""
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


def carry(
    points: np.ndarray,
    surface_motion: SurfaceMotion,
    root_vertices: np.ndarray,
    barycentric: np.ndarray,
    is_back: bool = False,
) -> np.ndarray:
    """(N, P, 3) float32 points of strands → float32, each strand moved rigidly with the surface at its root.

    root_vertices: (N, 3) int32 corners of the triangles that roots lie in; barycentric: (N, 3) float32 in their order;
    is_back: the inverse, from where the surface went to where it was. Raises `HairError` where these are not of the
    same strands, or of another surface.
    """
    vertex_count = len(surface_motion.before)
    require_count("vertices", len(surface_motion.after), vertex_count)
    require_count("vertices", len(surface_motion.axes), vertex_count)
    require_count("roots", len(root_vertices), len(points))
    require_count("barycentric coordinates", len(barycentric), len(points))
    require_indices("vertices", root_vertices, vertex_count)
    carried = wp.empty(points.shape[:2], dtype=wp.vec3, device="cpu")

    def shared(array, kind):
        return wp.array(np.ascontiguousarray(array), dtype=kind, device="cpu", copy=False)

    kernel_cache.launch(
        _carry,
        dim=len(points),
        inputs=[
            shared(points, wp.vec3),
            shared(surface_motion.before, wp.vec3),
            shared(surface_motion.after, wp.vec3),
            shared(surface_motion.axes, wp.vec3),
            shared(root_vertices, wp.vec3i),
            shared(barycentric, wp.vec3),
            is_back,
        ],
        outputs=[carried],
        device="cpu",
    )
    return carried.numpy()


@wp.func
def _unit(vector: wp.vec3, otherwise: wp.vec3):
    length = wp.length(vector)
    return wp.where(length > 0.0, vector / wp.max(length, 1.0e-37), otherwise)


@wp.kernel
def _carry(
    points: wp.array2d[wp.vec3],
    before: wp.array[wp.vec3],
    after: wp.array[wp.vec3],
    axes: wp.array2d[wp.vec3],
    root_vertices: wp.array[wp.vec3i],
    barycentric: wp.array[wp.vec3],
    is_back: bool,
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    strand = wp.tid()
    from_root = wp.vec3()
    to_root = wp.vec3()
    x_axis = wp.vec3()
    y_axis = wp.vec3()
    change = float(0.0)
    for corner in range(3):
        vertex = root_vertices[strand][corner]
        weight = barycentric[strand][corner]
        from_root += weight * before[vertex]
        to_root += weight * after[vertex]
        x_axis += weight * axes[vertex, 0]
        y_axis += weight * axes[vertex, 1]
        change += wp.length_sq(after[vertex] - before[vertex])
        change += wp.length_sq(axes[vertex, 0] - wp.vec3(1.0, 0.0, 0.0))
        change += wp.length_sq(axes[vertex, 1] - wp.vec3(0.0, 1.0, 0.0))
    if change == 0.0:
        for point in range(points.shape[1]):  # undeformed parts do not change, bit for bit
            out_points[strand, point] = points[strand, point]
        return
    x_axis = _unit(x_axis, wp.vec3(1.0, 0.0, 0.0))
    z_axis = _unit(wp.cross(x_axis, y_axis), wp.vec3(0.0, 0.0, 1.0))
    rotation = wp.matrix_from_cols(x_axis, wp.cross(z_axis, x_axis), z_axis)
    if is_back:
        rotation = wp.transpose(rotation)
        root = to_root
        to_root = from_root
        from_root = root
    for point in range(points.shape[1]):
        out_points[strand, point] = to_root + rotation * (points[strand, point] - from_root)
