# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands packed for drawing in eight bytes per point: offsets from the root, quantized to the strand's own range.

A strand of P points is P + 1 texels of two floats: (root x, root y), (root z, range), then its points without the root.
An offset has 20 bits along each axis: its error is at most 2^-20 of the range, besides the rounding of positions. A
strand that fills a picture of 4,000 pixels is accurate to 0.004 pixels. The 60 bits are stored in two floats that are
always normal numbers, because textures preserve no other bits. shaders/strands/packed_strand.glsl does the same.
"""

import numpy as np
import warp as wp

from ..kernels import native_code, parallel
from ..kernels.checks import require_count
from ..kernels.parallel import Rows

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

HEAD_TEXELS = 2  # of a strand, before its points without the root
MOST = 2**19 - 1  # steps from the root to the end of the range on each side; the root is step 0
_MIDDLE = MOST + 1


@wp.func_native(native_code.body(__file__, "packed_strands.cpp", MOST=MOST))
def _pack_strand(  # type: ignore[empty-body]
    points: wp.array2d[wp.vec3], strand: int, texels: wp.array2d[wp.vec2], boxes: wp.array2d[wp.vec3]
):
    """Write the texels and the box of one strand."""


@wp.kernel
def _pack(points: wp.array2d[wp.vec3], texels: wp.array2d[wp.vec2], boxes: wp.array2d[wp.vec3]):
    strand = wp.tid()
    _pack_strand(points, strand, texels, boxes)


def texel_count(point_count: int) -> int:
    """Return the number of texels of a strand."""
    return HEAD_TEXELS + point_count - 1


def pack(points: np.ndarray, texels: np.ndarray) -> np.ndarray:
    """Write the texels of strands; returns the lowest and highest coordinates of their points, (2, 3) float32.

    points: (S, P, 3) float32; texels: (S, P + 1, 2) float32, contiguous. Strands with non-finite coordinates are
    non-finite after unpacking; the bounds of no strands are zero. Raises `HairError` if counts do not match.
    """
    strand_count, point_count, _xyz = points.shape
    if not strand_count:
        return np.zeros((2, 3), np.float32)
    points = np.ascontiguousarray(points, np.float32)
    require_count("texels", texels.size, strand_count * texel_count(point_count) * 2)
    inputs = [Rows(wp.array(points, dtype=wp.vec3, device="cpu", copy=False))]
    # A second pass over all points would take as long as packing.
    boxes = np.empty((strand_count, 2, 3), np.float32)
    outputs = [wp.array(texels, dtype=wp.vec2, device="cpu", copy=False)]
    outputs.append(wp.array(boxes, dtype=wp.vec3, device="cpu", copy=False))
    parallel.launch(_pack, strand_count, inputs, outputs, "cpu")
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def unpack(texels: np.ndarray) -> np.ndarray:
    """Return points (S, P, 3) float32 of texels (S, P + 1, 2)."""
    head = texels[:, :HEAD_TEXELS].reshape(-1, 1, 4)
    words = np.ascontiguousarray(texels[:, HEAD_TEXELS:]).view(np.uint32)
    low, high = np.moveaxis((words & 0x1FFFFFFF) | (words >> 31) << 29, -1, 0)
    steps = np.stack([low >> 10, high >> 10, (low & 1023) | (high & 1023) << 10], axis=-1).astype(np.float32) - _MIDDLE
    offsets = steps * (head[..., 3:] / np.float32(MOST))
    return head[..., :3] + np.pad(offsets, ((0, 0), (1, 0), (0, 0)))
