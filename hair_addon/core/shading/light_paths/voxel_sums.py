# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums over paths and samples by voxel and hair system, on the device of a grid. Linked hair has common sums."""

import numpy as np
import warp as wp

from ...kernels import kernel_cache
from ...kernels.checks import require_count
from . import row_sums
from .start_places import voxel_at
from .strand_grid import StrandGrid
from .voxel_means import CHANNELS

wp.set_module_options({"enable_backward": False})

_MOST_PARTS = 4096  # parts of all values


@wp.kernel
def _find_rows(
    places: wp.array[wp.vec3],
    segments: wp.array[int],
    strands: wp.array[int],
    sums: wp.array[int],
    corner: wp.vec3,
    voxel: float,
    shape: wp.vec3i,
    out_rows: wp.array[int],
):
    """Find the voxel of each place, for the hair of its segment."""
    index = wp.tid()
    cell = voxel_at(places[index], corner, voxel, shape)
    row = (cell[2] * shape[1] + cell[1]) * shape[0] + cell[0]
    out_rows[index] = sums[strands[segments[index]]] * (shape[0] * shape[1] * shape[2]) + row


@wp.kernel
def _carry(
    before: wp.array2d[wp.float64],
    before_shape: wp.vec3i,
    before_corner: wp.vec3,
    before_voxel: float,
    corner: wp.vec3,
    voxel: float,
    shape: wp.vec3i,
    weight: wp.float64,
    out_sums: wp.array2d[wp.float64],
):
    """Add the sums of the voxel of another grid that contains a voxel's center."""
    row, channel = wp.tid()
    count = shape[0] * shape[1] * shape[2]
    at = row % count
    cell = wp.vec3(float(at % shape[0]), float(at / shape[0] % shape[1]), float(at / (shape[0] * shape[1])))
    place = (corner + voxel * (cell + wp.vec3(0.5, 0.5, 0.5)) - before_corner) / before_voxel
    x = int(wp.floor(place[0]))
    y = int(wp.floor(place[1]))
    z = int(wp.floor(place[2]))
    is_low = x >= 0 and y >= 0 and z >= 0
    if is_low and x < before_shape[0] and y < before_shape[1] and z < before_shape[2]:
        first = row / count * (before_shape[0] * before_shape[1] * before_shape[2])
        known = before[first + (z * before_shape[1] + y) * before_shape[0] + x, channel]
        out_sums[row, channel] += weight * known


class VoxelSums:
    """(different hair, Z, Y, X, C) sums over a `StrandGrid`, zero at first; by default `voxel_means.CHANNELS`."""

    def __init__(self, grid: StrandGrid, channel_count: int = CHANNELS) -> None:
        self.grid = grid
        self._voxels = grid.shape[::-1]
        rows = (max(grid.sums_of_systems) + 1) * int(np.prod(self._voxels))
        self._sums = wp.zeros((rows, channel_count), dtype=wp.float64, device=grid.device)

    def of_systems(self) -> list[wp.array4d[wp.float64]]:
        """Return the sums (Z, Y, X, C) of each hair system: the same object for linked hair."""
        count, shape = int(np.prod(self._voxels)), (*self._voxels, self._sums.shape[1])
        firsts = range(0, len(self._sums), count)
        found = [self._sums[first : first + count].reshape(shape) for first in firsts]
        return [found[index] for index in self.grid.sums_of_systems]

    def scale(self, weight: float) -> None:
        """Multiply all sums by a weight."""
        row_sums.scale(self._sums, weight)

    def carry(self, before: "VoxelSums", weight: float, shift: np.ndarray | float) -> None:
        """Add the sums of another grid on this device with as many different hair systems, multiplied by a weight.

        shift: (3,) offset of the other grid's voxels [m]. Voxels outside the other grid do not change.
        """
        own, other = self.grid, before.grid
        require_count("sums of hair", len(set(other.sums_of_systems)), len(set(own.sums_of_systems)))
        size = (own.voxel / other.voxel) ** 3
        corner, shifted = own.corner.tolist(), (other.corner + shift).tolist()
        given = [before._sums, wp.vec3i(*other.shape), wp.vec3(*shifted), other.voxel]
        given += [wp.vec3(*corner), own.voxel, wp.vec3i(*own.shape), wp.float64(weight * size)]
        kernel_cache.launch(_carry, self._sums.shape, given, [self._sums], self._sums.device)

    def add(
        self,
        places: wp.array[wp.vec3],
        segments: wp.array[int],
        first_values: wp.array[wp.vec3],
        second_values: wp.array[wp.vec3],
        first_channel: int,
    ) -> None:
        """Add `first_values`, RGB (N,), to three channels from `first_channel` on, `second_values` to the next three.

        segments: of the grid, which the caller has checked.
        """
        count = len(segments)
        for values in (places, first_values, second_values):
            require_count("values by voxel", len(values), count)
        if not count:
            return
        rows, grid = wp.empty(count, dtype=int, device=self._sums.device), self.grid
        given = [places, segments, grid.strands, grid.sums]
        given += [wp.vec3(*grid.corner.tolist()), grid.voxel, wp.vec3i(*grid.shape)]
        kernel_cache.launch(_find_rows, count, given, [rows], rows.device)
        row_sums.add(self._sums, rows, first_values, second_values, first_channel)


@wp.kernel
def _add_brightness(values: wp.array[wp.vec3], part_size: int, out_parts: wp.array2d[wp.float64]):
    part = wp.tid()
    total = wp.float64(0.0)
    squares = wp.float64(0.0)
    for index in range(part * part_size, wp.min((part + 1) * part_size, values.shape[0])):
        value = values[index]
        brightness = wp.float64(value[0]) + wp.float64(value[1]) + wp.float64(value[2])
        total += brightness
        squares += brightness * brightness
    out_parts[part, 0] = total
    out_parts[part, 1] = squares


def brightness(values: wp.array[wp.vec3]) -> tuple[float, float]:
    """Return the sum of all channels of (N,) RGB values, and the sum of the squares of each value's channel sum."""
    if not len(values):
        return 0.0, 0.0
    size = -(-len(values) // _MOST_PARTS)
    parts = wp.empty((-(-len(values) // size), 2), dtype=wp.float64, device=values.device)
    kernel_cache.launch(_add_brightness, len(parts), [values, size], [parts], values.device)
    total, squares = parts.numpy().sum(axis=0).tolist()
    return total, squares
