# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest triangle in each sample of a picture, for triangles with or without a texture of coverage."""

import numpy as np
import warp as wp

from ..errors import HairError
from ..kernels import kernel_cache
from ..kernels.checks import require_count

# No gradients are needed. Without fused multiply-add all processors round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

NONE = -1  # index in samples without a triangle
_FARTHEST = 2**31 - 1  # depths are integers, so that the nearest one does not depend on the order of triangles


class Samples:
    """The nearest triangles in a square picture with `size` samples along a side."""

    def __init__(self, size: int) -> None:
        self._size, self._count = size, 0
        self._least = wp.full(size * size, wp.uint64(2**63 - 1), dtype=wp.uint64, device="cpu")

    def add(self, corners: np.ndarray, uvs: np.ndarray | None = None, alpha: np.ndarray | None = None) -> None:
        """Add triangles with corners (T, 3, 3): x and y in samples, and a depth from 0, near, to 1.

        uvs: (T, 3, 2) coordinates of the corners in a texture alpha (n, n), bottom row first, from 0 to 1: the part of
        samples that the texture covers. Raises `HairError` for coordinates that are not finite.
        """
        if not np.isfinite(corners).all() or not (uvs is None or np.isfinite(uvs).all()):
            raise HairError("Some strands have non-finite coordinates: regenerate the hair.")
        if uvs is None or alpha is None:
            uvs, alpha = np.zeros((1, 3, 2)), np.zeros((0, 0))
        else:
            require_count("texture coordinates", len(uvs), len(corners))
        inputs = [
            wp.array(np.ascontiguousarray(corners, np.float32), dtype=wp.vec3, device="cpu"),
            wp.array(np.ascontiguousarray(uvs, np.float32), dtype=wp.vec2, device="cpu"),
            wp.array(np.ascontiguousarray(alpha, np.float32), dtype=float, device="cpu"),
            self._size,
            self._count,
        ]
        kernel_cache.launch(_nearest, len(corners), inputs, [self._least], device="cpu")
        self._count += len(corners)

    def triangles(self) -> np.ndarray:
        """Return the index (size, size) int64 of the nearest triangle, in order of addition, or `NONE`; row 0 has the
        least y.
        """
        found = self._least.numpy()
        indices = (found & np.uint64(0xFFFFFFFF)).astype(np.int64)
        return np.where(found >> np.uint64(32) < _FARTHEST, indices, NONE).reshape(self._size, self._size)


@wp.func
def _side(a: wp.vec3, b: wp.vec3, x: float, y: float):
    """Return twice the signed area of the triangle of two corners and a place."""
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])


@wp.func
def _threshold(triangle: int, x: int, y: int):
    """Return a number in [0, 1) that differs between triangles and between samples."""
    bits = wp.uint32(triangle) * wp.uint32(0x1E3779B1) + wp.uint32(x) * wp.uint32(0x05EBCA77)
    bits = bits + wp.uint32(y) * wp.uint32(0x42B2AE3D)
    bits = (bits ^ (bits >> wp.uint32(15))) * wp.uint32(0x2C1B3C6D)
    bits = (bits ^ (bits >> wp.uint32(12))) * wp.uint32(0x297A2D39)
    bits = bits ^ (bits >> wp.uint32(15))
    return float(bits >> wp.uint32(8)) / 16777216.0


@wp.kernel
def _nearest(
    corners: wp.array2d[wp.vec3],
    uvs: wp.array2d[wp.vec2],
    alpha: wp.array2d[float],
    size: int,
    first: int,
    # outputs
    out_least: wp.array[wp.uint64],
):
    triangle = wp.tid()
    a, b, c = corners[triangle, 0], corners[triangle, 1], corners[triangle, 2]
    area = _side(a, b, c[0], c[1])
    if area == 0.0:
        return
    share, last = 1.0 / area, float(size) - 1.0
    left = int(wp.clamp(wp.ceil(wp.min(a[0], wp.min(b[0], c[0])) - 0.5), 0.0, last))
    right = int(wp.clamp(wp.floor(wp.max(a[0], wp.max(b[0], c[0])) - 0.5), -1.0, last))
    low = int(wp.clamp(wp.ceil(wp.min(a[1], wp.min(b[1], c[1])) - 0.5), 0.0, last))
    high = int(wp.clamp(wp.floor(wp.max(a[1], wp.max(b[1], c[1])) - 0.5), -1.0, last))
    side = alpha.shape[0]
    for y in range(low, high + 1):
        for x in range(left, right + 1):
            of_a = _side(b, c, float(x) + 0.5, float(y) + 0.5) * share
            of_b = _side(c, a, float(x) + 0.5, float(y) + 0.5) * share
            of_c = _side(a, b, float(x) + 0.5, float(y) + 0.5) * share
            if of_a >= 0.0 and of_b >= 0.0 and of_c >= 0.0:
                covered = float(1.0)
                if side > 0:
                    uv = of_a * uvs[triangle, 0] + of_b * uvs[triangle, 1] + of_c * uvs[triangle, 2]
                    column = int(wp.clamp(uv[0] * float(side), 0.0, float(side) - 1.0))
                    row = int(wp.clamp(uv[1] * float(side), 0.0, float(side) - 1.0))
                    covered = alpha[row, column]
                if covered > _threshold(triangle, x, y):
                    depth = wp.clamp(of_a * a[2] + of_b * b[2] + of_c * c[2], 0.0, 1.0)
                    key = wp.uint64(int(depth * 2.0e9)) << wp.uint64(32)
                    wp.atomic_min(out_least, y * size + x, key | wp.uint64(first + triangle))
