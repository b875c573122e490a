# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear transforms of strands."""

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.checks import require_count
from ..kernels.parallel import Rows

# No gradients are needed. Without fused multiply-add all devices round alike.
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


def transformed(points: np.ndarray, matrix: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    """Return points (S, P, 3) float32 times a matrix (3, 3); for the identity, the given points themselves.

    out: array for the result, which may be `points`; None for a new one.
    """
    points = np.ascontiguousarray(points, np.float32)
    if not len(points) or np.array_equal(matrix, np.eye(3)):
        return points
    source = wp.array(points, dtype=wp.vec3, device="cpu", copy=False)
    if out is None:
        moved = parallel.empty_vectors(source.shape, "cpu")
    else:
        require_count("points", out.size, points.size)
        moved = wp.array(out, dtype=wp.vec3, device="cpu", copy=False)
    matrix = wp.mat33(*np.asarray(matrix, np.float32).ravel().tolist())
    parallel.launch(_transform, len(points), inputs=[Rows(source), matrix], outputs=[moved], device="cpu")
    return moved.numpy()
