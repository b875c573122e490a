# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands of a UV map, and the texels that each island covers."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from .. import geometry
from ..kernels import kernel_cache

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_NONE = 2**30  # lowest island of a texel that no island covers
_STACKED = 0.25  # islands that share this fraction of the smaller island's texels were stacked on purpose


def islands(corner_uvs: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the island (F,) int32 of each triangle: triangles that share a vertex with the same UV are connected.

    corner_uvs: (F, 3, 2) float32; triangles: (F, 3) vertices.
    """
    uvs = np.ascontiguousarray(corner_uvs, np.float32) + np.float32(0.0)  # negative zeros become zeros
    _, places = np.unique(uvs.reshape(-1, 2).view(np.uint64)[:, 0], return_inverse=True)
    keys = places.astype(np.int64) * (int(triangles.max(initial=0)) + 1) + triangles.reshape(-1)
    found, corners = np.unique(keys, return_inverse=True)
    joined = geometry.faces.connected_components.joined(corners.reshape(-1, 3), len(found))
    _, numbers = np.unique(joined, return_inverse=True)
    return numbers.reshape(-1).astype(np.int32)


@dataclass(frozen=True, eq=False)
class Coverage:
    """The islands that touch the texels of an image, at full size and at each halved size.

    lows, highs: the lowest and highest island in each texel (H, W) int32, for each size; islands: (F,) int32 of
    triangles; stacked islands share a number.
    """

    islands: np.ndarray
    lows: list[np.ndarray]
    highs: list[np.ndarray]

    def is_of(self, level: int, texels: np.ndarray, island: np.ndarray) -> np.ndarray:
        """Return (...) bool: whether only its island (...) touches each texel (...), a flat index of a level."""
        return (self.lows[level].ravel()[texels] == island) & (self.highs[level].ravel()[texels] == island)


def coverage(corner_uvs: np.ndarray, islands_of: np.ndarray, size: tuple[int, int], tile: int | None) -> Coverage:
    """Return the `Coverage` of an image of size (width, height).

    islands_of: (F,) from `islands`; tile: a UDIM tile such as 1001; None if the image repeats.
    """
    width, height = size
    corners = corner_uvs.astype(np.float64)
    if tile is not None:
        corners = corners - ((tile - 1001) % 10, (tile - 1001) // 10)
    corners = corners * (width, height)
    low, high = _touched(corners, islands_of, width, height, tile is None)
    numbers = _merged(low, high, int(islands_of.max(initial=0)) + 1)
    if numbers is not None:
        islands_of, is_covered = numbers[islands_of], high >= 0
        lowest = np.minimum(numbers[low[is_covered]], numbers[high[is_covered]])
        high[is_covered] = np.maximum(numbers[low[is_covered]], numbers[high[is_covered]])
        low[is_covered] = lowest
    lows, highs = [low.reshape(height, width)], [high.reshape(height, width)]
    while max(lows[-1].shape) > 1:
        lows.append(_halved(lows[-1], np.minimum))
        highs.append(_halved(highs[-1], np.maximum))
    return Coverage(islands_of, lows, highs)


def _touched(corners, islands_of, width, height, repeats):
    """Return the lowest and the highest island (H × W,) of each texel; corners: (F, 3, 2) [texels]."""
    first, second, third = np.moveaxis(corners, 1, 0)
    area = (second - first)[:, 0] * (third - first)[:, 1] - (second - first)[:, 1] * (third - first)[:, 0]
    corners = np.where((area < 0.0)[:, None, None], corners[:, [0, 2, 1]], corners)
    with np.errstate(invalid="ignore"):
        low, high = np.floor(corners.min(axis=1)), np.ceil(corners.max(axis=1))
    is_known = np.isfinite(corners).all(axis=(1, 2)) & (area != 0.0) & (np.abs(corners).max(axis=(1, 2)) < 2.0**30)
    if not repeats:
        low, high = np.maximum(low, 0.0), np.minimum(high, (width, height))
    known = np.flatnonzero(is_known & (high > low).all(axis=1))
    lows = wp.array(np.full(width * height, _NONE, np.int32), dtype=int, device="cpu")
    highs = wp.array(np.full(width * height, -1, np.int32), dtype=int, device="cpu")
    if len(known):
        corners = wp.array(corners[known], dtype=wp.vec2d, ndim=2, device="cpu")
        boxes = wp.array(np.concatenate([low, high], axis=1)[known].astype(np.int32), dtype=wp.vec4i, device="cpu")
        owners = wp.array(islands_of[known].astype(np.int32), dtype=int, device="cpu")
        size = wp.vec2i(width, height)
        kernel_cache.launch(
            _touch, dim=len(known), inputs=[corners, boxes, owners, size], outputs=[lows, highs], device="cpu"
        )
    return lows.numpy(), highs.numpy()


@wp.kernel
def _touch(
    corners: wp.array2d[wp.vec2d],
    boxes: wp.array[wp.vec4i],
    owners: wp.array[int],
    size: wp.vec2i,
    # outputs
    out_lows: wp.array[int],
    out_highs: wp.array[int],
):
    triangle = wp.tid()
    box = boxes[triangle]
    # A triangle wider than a repeated image touches its texels again.
    right = wp.min(box[2], box[0] + size[0])
    top = wp.min(box[3], box[1] + size[1])
    is_wide = right < box[2] or top < box[3]
    for row in range(box[1], top):
        for column in range(box[0], right):
            middle = wp.vec2d(wp.float64(column) + wp.float64(0.5), wp.float64(row) + wp.float64(0.5))
            is_touched = bool(True)
            for corner in range(3):
                start = corners[triangle, corner]
                edge = corners[triangle, (corner + 1) % 3] - start
                offset = middle - start
                half = wp.float64(0.5) * (wp.abs(edge[0]) + wp.abs(edge[1]))
                # The greatest value of the edge function in the texel.
                if edge[0] * offset[1] - edge[1] * offset[0] + half <= wp.float64(1e-9) * half:
                    is_touched = False
            if is_touched or is_wide:
                texel = ((row % size[1] + size[1]) % size[1]) * size[0] + (column % size[0] + size[0]) % size[0]
                wp.atomic_min(out_lows, texel, owners[triangle])
                wp.atomic_max(out_highs, texel, owners[triangle])


def _merged(low, high, count):
    """Return the numbers (count,) of islands after stacked islands are joined; None if no texel has two islands."""
    is_shared = (high >= 0) & (low != high)
    if not is_shared.any():
        return None
    sizes = np.bincount(low[high >= 0], minlength=count) + np.bincount(high[is_shared], minlength=count)
    pairs, shared = np.unique(low[is_shared].astype(np.int64) * count + high[is_shared], return_counts=True)
    numbers = np.arange(count, dtype=np.int32)
    one, other = pairs // count, pairs % count
    are_stacked = shared > _STACKED * np.minimum(sizes[one], sizes[other])
    for first, second in zip(one[are_stacked], other[are_stacked], strict=True):
        numbers[numbers == numbers[second]] = numbers[first]
    return numbers


def _halved(values, reduce):
    height, width = values.shape
    padded = np.pad(values, ((0, height % 2), (0, width % 2)), mode="edge")
    rows = reduce(padded[::2], padded[1::2])
    return np.ascontiguousarray(reduce(rows[:, ::2], rows[:, 1::2]))
