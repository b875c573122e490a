# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands in other coordinates."""

import numpy as np
import warp as wp

from . import cores
from .cores import Rows

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def _transform(
    points: wp.array2d[wp.vec3],
    matrix: wp.mat33,
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    strand = wp.tid()
    for point in range(points.shape[1]):
        out_points[strand, point] = matrix * points[strand, point]


def transformed(points, matrix, out=None):
    """(S, P, 3) float32 points, each multiplied by a (3, 3) matrix; by the identity they are themselves.

    out: array to put them in, which may be that of the points; None for a new one.
    """
    points = np.ascontiguousarray(points, np.float32)
    if not len(points) or np.array_equal(matrix, np.eye(3)):
        return points
    there = wp.array(points, dtype=wp.vec3, device="cpu", copy=False)
    if out is None:
        moved = cores.empty_vectors(there.shape, "cpu")
    else:
        moved = wp.array(out, dtype=wp.vec3, device="cpu", copy=False)
    matrix = wp.mat33(*np.asarray(matrix, np.float32).ravel().tolist())
    cores.launch(_transform, len(points), inputs=[Rows(there), matrix], outputs=[moved], device="cpu")
    return moved.numpy()
