# SPDX-License-Identifier: GPL-3.0-or-later
"""Deformation of strands with their surface, by rotations that are continuous over the surface.

A face's deformation gradient maps two of its edges and its unit normal to their present directions. The rotation at a
vertex is the polar factor U V^T of the mean over its faces (vertex_turns.py) [Higham86]; between vertices two of its
columns are interpolated and orthonormalized. Thus rigid motion is reproduced exactly, shear and stretch rotate no more
than necessary, and neighboring roots do not separate, as they do with frames of single triangles or of a UV map.
blender/data/strands/follow_nodes.py implements the same in geometry nodes.

A deformed subdivided surface is smooth, but at rest its vertices lie on the flat faces of its cage. Rotations from flat
faces would separate neighboring roots. Therefore rotations are measured from the smooth surface of the cage
(smooth_surface.py).
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ..kernels import kernel_cache
from ..kernels.checks import require_count, require_indices
from . import vertex_turns
from .mesh import Faces, require_finite
from .vertex_turns import VertexRotations

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@dataclass(frozen=True)
class SurfaceMotion:
    """Positions of a mesh's vertices before and after, (V, 3) float32, and the rotations of the surface.

    axes: (V, 2, 3) float32, the images of the x and the y axis under the rotation at each vertex.
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
    """Return the `SurfaceMotion` of vertices (V, 3) from `before` to `after`; faces: the mesh's `Faces`.

    vertices: indices, in any shape, of vertices that need a rotation, None for all; smooth_before: (V, 3) on the smooth
    surface from which rotations are measured, None for `before`. Raises `HairError` for non-finite vertices.
    """
    require_finite(before)
    require_finite(after)
    at_rest = before if smooth_before is None else smooth_before
    return turned(before, after, vertex_turns.turning(at_rest, faces, vertices))


def turned(before: np.ndarray, after: np.ndarray, turning: VertexRotations) -> SurfaceMotion:
    """Return the `SurfaceMotion` by `VertexRotations`, which serve many poses; only their vertices get rotations."""
    require_finite(after)
    require_count("vertices", len(after), len(before))
    found = turning.axes(after)
    if len(found) == len(before):
        return SurfaceMotion(before, after, found)
    axes = np.empty((len(before), 2, 3), np.float32)
    axes[:] = vertex_turns.UNTURNED
    axes[turning.vertices] = found
    return SurfaceMotion(before, after, axes)


def carry(
    points: np.ndarray,
    surface_motion: SurfaceMotion,
    root_vertices: np.ndarray,
    barycentric: np.ndarray,
    is_back: bool = False,
) -> np.ndarray:
    """Return points (N, P, 3) float32 of strands, moved rigidly with the surface at the roots of the strands.

    root_vertices: (N, 3) int32 corners of the roots' triangles; barycentric: (N, 3) float32 in the same order; is_back:
    apply the inverse motion, from `after` to `before`. Raises `HairError` if counts or indices do not match.
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
        for point in range(points.shape[1]):  # undeformed parts stay bit-identical
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
