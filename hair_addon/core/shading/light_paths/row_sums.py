# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums of RGB values by row, with the same bits in any order of the values.

On a GPU integers are added, scaled so that the sum of all values fits 62 bits even if all equal the largest.
"""

import warp as wp

from ...kernels import kernel_cache
from ...kernels.checks import require_count

wp.set_module_options({"enable_backward": False})

_MOST_PARTS = 4096  # parts of all values
_LARGEST_SUM = 4.0e18  # limit of integers, below 2^62


@wp.kernel
def _add_in_order(
    rows: wp.array[int],
    first_values: wp.array[wp.vec3],
    second_values: wp.array[wp.vec3],
    first_channel: int,
    out_sums: wp.array2d[wp.float64],
):
    """Add values one after the other, on one CPU core."""
    index = wp.tid()
    row = rows[index]
    if row >= 0:
        for channel in range(3):
            out_sums[row, first_channel + channel] += wp.float64(first_values[index][channel])
            out_sums[row, first_channel + 3 + channel] += wp.float64(second_values[index][channel])


@wp.kernel
def _find_largest(
    first_values: wp.array[wp.vec3], second_values: wp.array[wp.vec3], part_size: int, out_largest: wp.array[float]
):
    part = wp.tid()
    largest = float(0.0)
    for index in range(part * part_size, wp.min((part + 1) * part_size, first_values.shape[0])):
        for channel in range(3):
            largest = wp.max(largest, wp.abs(first_values[index][channel]))
            largest = wp.max(largest, wp.abs(second_values[index][channel]))
    wp.atomic_max(out_largest, 0, largest)


@wp.func
def _scale(largest: wp.array[float], count: int):
    """Return the integer that represents one, for `count` values up to the largest."""
    return wp.float64(_LARGEST_SUM) / (wp.max(wp.float64(largest[0]), wp.float64(1e-30)) * wp.float64(count))


@wp.kernel
def _add_whole(
    rows: wp.array[int],
    first_values: wp.array[wp.vec3],
    second_values: wp.array[wp.vec3],
    largest: wp.array[float],
    out_whole: wp.array2d[wp.int64],
):
    index = wp.tid()
    row = rows[index]
    if row >= 0:
        scale = _scale(largest, first_values.shape[0])
        for channel in range(3):
            wp.atomic_add(out_whole, row, channel, wp.int64(scale * wp.float64(first_values[index][channel])))
            wp.atomic_add(out_whole, row, 3 + channel, wp.int64(scale * wp.float64(second_values[index][channel])))


@wp.kernel
def _add_sums(
    whole: wp.array2d[wp.int64],
    largest: wp.array[float],
    count: int,
    first_channel: int,
    out_sums: wp.array2d[wp.float64],
):
    row, channel = wp.tid()
    if whole[row, channel] != wp.int64(0):
        out_sums[row, first_channel + channel] += wp.float64(whole[row, channel]) / _scale(largest, count)


@wp.kernel
def _multiply(weight: wp.float64, out_sums: wp.array2d[wp.float64]):
    row, channel = wp.tid()
    out_sums[row, channel] *= weight


def add(
    sums: wp.array2d[wp.float64],
    rows: wp.array[int],
    first_values: wp.array[wp.vec3],
    second_values: wp.array[wp.vec3],
    first_channel: int = 0,
) -> None:
    """Add `first_values`, RGB (N,), to three channels of sums (R, C) from `first_channel` on, `second_values` to the
    next three.

    rows: (N,) indices, which the caller has checked; negative for values that count nowhere.
    """
    for values in (first_values, second_values):
        require_count("values by row", len(values), len(rows))
    if len(rows) and len(sums):
        way = _in_order if sums.device.is_cpu else _in_any_order
        way(sums, [rows, first_values, second_values], first_channel)


def scale(sums: wp.array2d[wp.float64], weight: float) -> None:
    """Multiply all sums by a weight."""
    kernel_cache.launch(_multiply, sums.shape, [wp.float64(weight)], [sums], sums.device)


def _in_order(sums, given, first_channel):
    kernel_cache.launch(_add_in_order, len(given[1]), [*given, first_channel], [sums], sums.device)


def _in_any_order(sums, given, first_channel):
    count, device = len(given[1]), sums.device
    largest = wp.zeros(1, dtype=float, device=device)
    whole = wp.zeros((len(sums), 6), dtype=wp.int64, device=device)
    size = -(-count // _MOST_PARTS)
    kernel_cache.launch(_find_largest, -(-count // size), [*given[1:], size], [largest], device)
    kernel_cache.launch(_add_whole, count, [*given, largest], [whole], device)
    kernel_cache.launch(_add_sums, whole.shape, [whole, largest, count, first_channel], [sums], device)
