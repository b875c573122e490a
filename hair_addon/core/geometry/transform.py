# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear transforms of strands, and rotations about their roots."""

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


@wp.kernel
def _turn(
    points: wp.array2d[wp.vec3],
    rotations: wp.array[wp.mat33d],
    is_turned: wp.array[wp.bool],
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    strand = wp.tid()
    root = wp.vec3d(points[strand, 0])
    for point in range(points.shape[1]):
        place = points[strand, point]
        if is_turned[strand]:
            place = wp.vec3(root + rotations[strand] * (wp.vec3d(place) - root))
        out_points[strand, point] = place


def turned_about_roots(points: np.ndarray, rotations: np.ndarray, is_turned: np.ndarray) -> np.ndarray:
    """Return points (S, P, 3) float32 of strands rotated about their first points by matrices (S, 3, 3).

    is_turned: (S,) bool; other strands keep their bits.
    """
    if not points.size:
        return points
    source = wp.array(np.ascontiguousarray(points, np.float32), dtype=wp.vec3, device="cpu", copy=False)
    matrices = wp.array(np.ascontiguousarray(rotations, np.float64), dtype=wp.mat33d, device="cpu", copy=False)
    flags = wp.array(np.ascontiguousarray(is_turned, bool), dtype=wp.bool, device="cpu", copy=False)
    moved = parallel.empty_vectors(source.shape, "cpu")
    inputs = [Rows(source), Rows(matrices), Rows(flags)]
    parallel.launch(_turn, len(points), inputs=inputs, outputs=[moved], device="cpu")
    return moved.numpy()
