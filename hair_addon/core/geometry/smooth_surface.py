# SPDX-License-Identifier: GPL-3.0-or-later
"""Approximation of the smooth surface of a subdivided mesh from vertices on the flat faces of its cage.

Away from extraordinary vertices, a Catmull-Clark surface [Catmull78] is the bicubic B-spline of the cage, and the faces
of the cage are its bilinear B-spline. B-splines are convolutions of boxes, so the bicubic surface is the bilinear
surface convolved with a hat as wide as two faces, whose variance is 1/6 of a face squared along each axis. Repeated
means of neighboring vertices with the same variance approximate the hat. Normals are within a degree of the surface's,
and within ten degrees at the corners of a cube. follow_nodes.py of blender/data/strands uses the same blur.
"""

import math

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.checks import require_indices
from .mesh import Faces

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

HAT_VARIANCE = 1.0 / 6.0  # of a face of the cage, squared
MOST_VARIANCE = 0.4  # of an edge squared: the mean of a vertex and its four neighbors with equal weights
MOST_ROUNDS = 128  # enough for four levels; more levels are smoothed too little
LEAST_REFINEMENT = 2.0  # 4 × faces / corners of the cage: at least 4 with one level, at most 4/3 without


def rounds(face_count: int, cage_corners: int) -> tuple[int, float]:
    """Return the number of smoothing rounds and the weight of a neighbor, in single precision.

    face_count: of the subdivided mesh; cage_corners: corners of all faces of the cage, 0 for a mesh without smoothing.
    Returns (0, 0) without smoothing or subdivision.
    """
    if cage_corners <= 0:
        return 0, 0.0
    refinement = np.float32(4.0 * face_count) / np.float32(cage_corners)  # (2^levels)²
    if refinement < LEAST_REFINEMENT:
        return 0, 0.0
    variance = refinement * np.float32(HAT_VARIANCE)
    count = min(math.ceil(variance / np.float32(MOST_VARIANCE)), MOST_ROUNDS)
    part = min(variance / np.float32(count), np.float32(MOST_VARIANCE))
    return count, float(part / (np.float32(2.0) - np.float32(4.0) * part))  # 2 w / (1 + 4 w) = part


def smoothed(vertices: np.ndarray, faces: Faces, cage_corners: int) -> np.ndarray:
    """Return approximate positions (V, 3) float32 on the smooth surface, of vertices (V, 3) on the faces of its cage.

    cage_corners: see `rounds`. Vertices are returned unchanged without smoothing.
    """
    count, weight = rounds(len(faces.starts) - 1, cage_corners)
    if count == 0:
        return vertices
    require_indices("vertices", faces.corner_vertices, len(vertices))
    neighbours, starts = _neighbours(faces, len(vertices))
    first, end = (parallel.Rows(_ints(ends)) for ends in (starts[:-1], starts[1:]))
    neighbours = _ints(neighbours)
    values = wp.array(np.ascontiguousarray(vertices, np.float32), dtype=wp.vec3, device="cpu")
    following = wp.empty_like(values)
    for _ in range(count):
        inputs = [parallel.Rows(values), first, end, values, neighbours, weight]
        parallel.launch(_take_means, len(vertices), inputs, [following], "cpu")
        values, following = following, values
    return values.numpy()


def _ints(array):
    return wp.array(np.ascontiguousarray(array), dtype=int, device="cpu", copy=False)


def _neighbours(faces, vertex_count):
    """Return the neighbors by edges (N,) int32, concatenated over vertices, and starts (V + 1,) int32."""
    corners = faces.corner_vertices.astype(np.int64)
    following = np.roll(corners, -1)
    following[faces.starts[1:] - 1] = corners[faces.starts[:-1]]
    pairs = np.concatenate([corners * vertex_count + following, following * vertex_count + corners])
    pairs = np.unique(pairs)
    first, second = np.divmod(pairs, vertex_count)
    first, second = first[first != second], second[first != second]
    starts = np.append(0, np.cumsum(np.bincount(first, minlength=vertex_count)))
    return second.astype(np.int32), starts.astype(np.int32)


@wp.kernel
def _take_means(
    own: wp.array[wp.vec3],
    first: wp.array[int],
    end: wp.array[int],
    values: wp.array[wp.vec3],
    neighbours: wp.array[int],
    weight: float,
    # outputs
    out_values: wp.array[wp.vec3],
):
    vertex = wp.tid()
    total = own[vertex]
    for place in range(first[vertex], end[vertex]):
        total += weight * values[neighbours[place]]
    out_values[vertex] = total * (1.0 / (1.0 + weight * float(end[vertex] - first[vertex])))
