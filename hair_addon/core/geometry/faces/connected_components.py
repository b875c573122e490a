# SPDX-License-Identifier: GPL-3.0-or-later
"""Connected components of a triangle mesh."""

import numpy as np
import warp as wp

from ...kernels import kernel_cache
from ..mesh import TriMesh

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def connected_components(mesh: TriMesh) -> np.ndarray:
    """Return the component (F,) int32 of each triangle; vertices at the same position count as one."""
    found = joined(mesh.checked_triangles, len(mesh.vertices))
    if found.any():  # several components: vertices are merged, because seams do not separate a surface
        _, welded = np.unique(mesh.vertices, axis=0, return_inverse=True)
        found = joined(welded.reshape(-1)[mesh.triangles], len(mesh.vertices))
    _, numbers = np.unique(found, return_inverse=True)
    return numbers.reshape(-1).astype(np.int32)


def joined(triangles: np.ndarray, vertex_count: int) -> np.ndarray:
    """Return (F,) int32: the lowest vertex of the component of each triangle (F, 3) of valid vertices."""
    # Union-find is sequential, and therefore runs on the CPU.
    parents = wp.array(np.arange(vertex_count, dtype=np.int32), device="cpu")
    triangles = wp.array(triangles.astype(np.int32), dtype=int, device="cpu")
    found = wp.empty(len(triangles), dtype=int, device="cpu")
    kernel_cache.launch(_join, dim=1, inputs=[triangles, parents], outputs=[found], device="cpu")
    return found.numpy()


@wp.func
def _lowest(parents: wp.array[int], vertex: int):
    while parents[vertex] != vertex:
        parents[vertex] = parents[parents[vertex]]
        vertex = parents[vertex]
    return vertex


@wp.kernel
def _join(
    triangles: wp.array2d[int],
    parents: wp.array[int],
    # outputs
    out_islands: wp.array[int],
):
    for triangle in range(triangles.shape[0]):
        first = _lowest(parents, triangles[triangle, 0])
        for corner in range(1, 3):
            other = _lowest(parents, triangles[triangle, corner])
            parents[wp.max(first, other)] = wp.min(first, other)
            first = wp.min(first, other)
    for triangle in range(triangles.shape[0]):
        out_islands[triangle] = _lowest(parents, triangles[triangle, 0])
