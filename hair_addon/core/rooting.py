# SPDX-License-Identifier: GPL-3.0-or-later
"""Where roots are and which way the surface faces there: mesh.py's `positions` and `normals` on a device.

And what strands are told apart by, whichever others are there.
"""

import numpy as np
import warp as wp

from . import cores
from .cores import Rows

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
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
    if wp.length(smooth) < 1.0e-6:  # opposite normals cancel: the triangle's own
        longest = wp.max(wp.length(b - a), wp.length(c - a))
        smooth = wp.cross((b - a) / longest, (c - a) / longest)
    out_normals[root] = wp.normalize(smooth)


def rooted(mesh, points, device):
    """Positions [m] and unit normals, (N,) vec3 each, of `SurfacePoints` on a checked `TriMesh`."""

    def there(array, dtype):
        return wp.array(np.ascontiguousarray(array), dtype=dtype, device=device, copy=False)

    positions, normals = (wp.empty(len(points), dtype=wp.vec3, device=device) for _ in range(2))
    cores.launch(
        _root,
        len(points),
        inputs=[
            there(mesh.vertices, wp.vec3),
            there(mesh.vertex_normals, wp.vec3),
            there(mesh.triangles, wp.vec3i),
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


def identities(points):
    """What strands rooted at `SurfacePoints` are known by: (N,) int32, and numbers (N,) float32 in [0, 1).

    Both follow from the root alone, so they stay when others come and go; two roots in some thousand millions share
    theirs.
    """
    count = len(points)
    found, numbers = np.empty(count, np.int32), np.empty(count, np.float32)
    bits = np.ascontiguousarray(points.barycentric, np.float32).view(np.int32)
    arrays = (points.triangle, int), (bits, wp.vec3i), (found, int), (numbers, float)
    triangle, barycentric, *out = (wp.array(values, dtype=kind, device="cpu", copy=False) for values, kind in arrays)
    cores.launch(_identify, count, inputs=[Rows(triangle), Rows(barycentric)], outputs=out, device="cpu")
    return found, numbers
