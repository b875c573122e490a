# SPDX-License-Identifier: GPL-3.0-or-later
"""Positions and normals of roots on a device, like `positions` and `normals` of mesh.py, and IDs of strands."""

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.checks import require_count, require_indices
from ..kernels.parallel import Rows
from .mesh import SurfacePoints, TriMesh

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def _root(
    vertices: wp.array[wp.vec3],
    vertex_normals: wp.array[wp.vec3],
    triangles: wp.array[wp.vec3i],
    triangle: wp.array[int],
    barycentric: wp.array[wp.vec3],
    # outputs
    out_positions: wp.array[wp.vec3],
    out_normals: wp.array[wp.vec3],
):
    root = wp.tid()
    corners = triangles[triangle[root]]
    weights = barycentric[root]
    a = vertices[corners[0]]
    b = vertices[corners[1]]
    c = vertices[corners[2]]
    out_positions[root] = weights[0] * a + weights[1] * b + weights[2] * c
    smooth = (
        weights[0] * vertex_normals[corners[0]]
        + weights[1] * vertex_normals[corners[1]]
        + weights[2] * vertex_normals[corners[2]]
    )
    if wp.length(smooth) < 1.0e-6:  # opposite normals cancel: use the triangle's normal
        longest = wp.max(wp.length(b - a), wp.length(c - a))
        smooth = wp.cross((b - a) / longest, (c - a) / longest)
    out_normals[root] = wp.normalize(smooth)


def rooted(mesh: TriMesh, points: SurfacePoints, device: wp.DeviceLike) -> tuple[wp.array[wp.vec3], wp.array[wp.vec3]]:
    """Return positions [m] and unit normals, (N,) vec3 each, of `SurfacePoints` on a `TriMesh`.

    Raises `HairError` for points on missing triangles.
    """
    require_count("barycentric coordinates", len(points.barycentric), len(points.triangle))
    require_indices("triangles", points.triangle, len(mesh.triangles))

    def there(array, dtype):
        return wp.array(np.ascontiguousarray(array), dtype=dtype, device=device, copy=False)

    positions, normals = (wp.empty(len(points), dtype=wp.vec3, device=device) for _ in range(2))
    parallel.launch(
        _root,
        len(points),
        inputs=[
            there(mesh.vertices, wp.vec3),
            there(mesh.vertex_normals, wp.vec3),
            there(mesh.checked_triangles, wp.vec3i),
            Rows(there(points.triangle, int)),
            Rows(there(points.barycentric, wp.vec3)),
        ],
        outputs=[positions, normals],
        device=device,
    )
    return positions, normals


@wp.kernel
def _identify(
    triangle: wp.array[int],
    barycentric: wp.array[wp.vec3i],  # its bits
    # outputs
    out_identities: wp.array[int],
    out_numbers: wp.array[float],
):
    root = wp.tid()
    state = wp.rand_init(triangle[root], barycentric[root][0])
    state = wp.rand_init(int(state), barycentric[root][1])
    out_identities[root] = int(state)
    out_numbers[root] = wp.randf(state)


def identities(points: SurfacePoints, is_mirrored: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return IDs (N,) int32 and random numbers (N,) float32 in [0, 1) of strands rooted at `SurfacePoints`.

    is_mirrored: whether triangles are wound opposite to the stored roots.
    Both depend only on the root, not on other strands; two IDs are equal with a probability of 2^-32.
    """
    points = points.with_flipped_winding() if is_mirrored else points
    count = len(points)
    found, numbers = np.empty(count, np.int32), np.empty(count, np.float32)
    bits = np.ascontiguousarray(points.barycentric, np.float32).view(np.int32)
    arrays = (points.triangle, int), (bits, wp.vec3i), (found, int), (numbers, float)
    triangle, barycentric, *out = (wp.array(values, dtype=kind, device="cpu", copy=False) for values, kind in arrays)
    parallel.launch(_identify, count, inputs=[Rows(triangle), Rows(barycentric)], outputs=out, device="cpu")
    return found, numbers
