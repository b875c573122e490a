# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernel launches on all cores of the CPU, and arrays that are fast to fill.

A Warp launch on the CPU is a loop on one core, which releases the GIL. Rows are therefore divided among threads, each
with its own launch. `launch` is for independent rows, `launch_shares` for sums over rows. On a GPU both are one launch.
"""

import contextlib
import itertools
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from . import kernel_cache, kernel_setup
from .checks import require_count

PARTS_PER_CORE = 2  # for load balancing, because a core may have other work
UNEVEN_PARTS_PER_CORE = 4  # if parts may take unequal times
LEAST_ROWS = 4096  # fewer are not worth a thread
MOST_SHARES = 8  # shares of a sum, each in its own memory

_SLICE = 0.004  # [s] of a launch on one core between pauses
_FIRST_SLICE = 64  # rows in the first slice

_limits = threading.local()  # for threads that `on_one_core` limits


@dataclass(frozen=True)
class Rows:
    """An array of which thread i of a kernel accesses only row i."""

    array: wp.array

    def part(self, first: int, end: int) -> wp.array:
        """Return the rows from `first` to `end`."""
        return self.array if end - first == len(self.array) else self.array[first:end]


def launch(
    kernel: wp.Kernel,
    row_count: int,
    inputs: list[Any],
    outputs: list[wp.array],
    device: wp.DeviceLike,
    least_rows: int = LEAST_ROWS,
    under_way: Callable[[], None] | None = None,
    threads_per_row: int = 1,
) -> None:
    """Run a kernel. inputs: `Rows`, and arguments shared by all threads; outputs: arrays of rows.

    least_rows: fewer are not worth a CPU thread; under_way: called when all threads are about to begin; from then on
    they do not need the GIL until the end; threads_per_row: consecutive threads of the kernel for each row. Raises
    `HairError` if an array has a different number of rows.
    """
    device = wp.get_device(device)
    values = [*inputs, *map(Rows, outputs)]
    for rows in values:
        if isinstance(rows, Rows):
            require_count("rows", len(rows.array), row_count)
    if row_count == 0:
        return
    core_count = _core_count(device)
    # A thread needs the GIL to take a second part.
    most = core_count * (PARTS_PER_CORE if under_way is None else 1)
    part_count = min(most, row_count // least_rows) if core_count > 1 else 1

    def arguments(_part, first, end):
        return [value.part(first, end) if isinstance(value, Rows) else value for value in values]

    _launch_parts(kernel, arguments, row_count, max(1, part_count), device, under_way, threads_per_row)


def share_count(row_count: int, device: wp.DeviceLike, least_rows: int = LEAST_ROWS) -> int:
    """Return the number of shares, each with its own outputs, for `launch_shares`."""
    return max(1, min(_core_count(wp.get_device(device)), MOST_SHARES, row_count // least_rows))


def part_count(row_count: int, device: wp.DeviceLike, least_rows: int = LEAST_ROWS) -> int:
    """Return the number of shares for `launch_shares` with common outputs, if rows may take unequal times."""
    core_count = _core_count(wp.get_device(device))
    most = core_count * UNEVEN_PARTS_PER_CORE if core_count > 1 else 1
    return max(1, min(most, row_count // least_rows))


def launch_shares(
    kernel: wp.Kernel, row_count: int, inputs: list[Any], outputs: list[list[Any]], device: wp.DeviceLike
) -> None:
    """Run a kernel that adds to its outputs, with one share of rows for each list of output arrays.

    The kernel's last input is the first row of its share; thread i processes row i of the share.
    """

    def arguments(share, first, _end):
        return [*inputs, first, *outputs[share]]

    _launch_parts(kernel, arguments, row_count, len(outputs), wp.get_device(device))


def _core_count(device):
    """Return the number of simultaneous launches on a device."""
    return 1 if not device.is_cpu or getattr(_limits, "is_single", False) else kernel_setup.processor_count()


@contextlib.contextmanager
def on_one_core(pause: Callable[[], None] | None = None) -> Iterator[None]:
    """Launch kernels from the calling thread on no other thread.

    pause: called every few milliseconds of a launch on the CPU; it may wait, or raise an exception to end the launch.
    """
    before = getattr(_limits, "is_single", False), getattr(_limits, "pause", None)
    _limits.is_single, _limits.pause = True, pause
    try:
        yield
    finally:
        _limits.is_single, _limits.pause = before


def _launch_parts(kernel, arguments, row_count, part_count, device, under_way=None, threads_per_row=1):
    """Launch a kernel on parts of the rows, a thread per core; arguments(part, first, end): a part's arguments."""
    if part_count == 1:
        pause = getattr(_limits, "pause", None)
        if device.is_cpu and pause is not None:
            _launch_slices(kernel, arguments, row_count, device, threads_per_row, pause)
            return
        if under_way is not None:
            under_way()
        kernel_cache.launch(kernel, dim=row_count * threads_per_row, inputs=arguments(0, 0, row_count), device=device)
        return
    bounds = np.linspace(0, row_count, part_count + 1).astype(int).tolist()

    def launch_part(part):
        first, end = bounds[part : part + 2]
        kernel_cache.launch(
            kernel, dim=(end - first) * threads_per_row, inputs=arguments(part, first, end), device=device
        )

    kernel_cache.load(device, kernel.module)  # once, before the threads start
    if under_way is not None:
        parts = zip(range(part_count), bounds, bounds[1:], strict=False)
        prepared = [
            kernel_cache.prepared(kernel, (end - first) * threads_per_row, arguments(part, first, end), device)
            for part, first, end in parts
        ]
        numbers = itertools.count(1)

        def launch_part(part):
            if next(numbers) == part_count:  # all other parts have begun
                under_way()
            prepared[part].launch()

    _on_threads(launch_part, part_count, min(_core_count(device), part_count))


def _launch_slices(kernel, arguments, row_count, device, threads_per_row, pause):
    """Launch a kernel on consecutive rows, with a pause before each launch."""
    first, size = 0, _FIRST_SLICE
    while first < row_count:
        pause()
        end = min(first + size, row_count)
        started = time.perf_counter()
        kernel_cache.launch(kernel, dim=(end - first) * threads_per_row, inputs=arguments(0, first, end), device=device)
        taken = time.perf_counter() - started
        first = end
        if taken < 0.5 * _SLICE:
            size *= 2
        elif taken > 2.0 * _SLICE:
            size = max(size // 2, 1)


def _on_threads(run, part_count, thread_count):
    """Call run(part) for each part on several threads, including the present one, because threads start slowly."""
    parts = itertools.count()

    def run_parts():
        while (part := next(parts)) < part_count:
            run(part)

    with ThreadPoolExecutor(max(thread_count - 1, 1)) as pool:
        others = [pool.submit(run_parts) for _ in range(thread_count - 1)]
        run_parts()
    for other in others:
        other.result()  # re-raises the thread's exception


def empty_vectors(shape: tuple[int, ...], device: wp.DeviceLike) -> wp.array:
    """Return `wp.empty` of vec3; on the CPU, in NumPy's memory with large pages, which fills three times as fast."""
    device = wp.get_device(device)
    if not device.is_cpu:
        return wp.empty(shape, dtype=wp.vec3, device=device)
    return wp.array(np.empty((*shape, 3), np.float32), dtype=wp.vec3, device=device, copy=False)


def empty(count: int, kind: type, device: wp.DeviceLike) -> wp.array:
    """Return `wp.empty` of numbers, in memory like that of `empty_vectors`."""
    device = wp.get_device(device)
    if not device.is_cpu:
        return wp.empty(count, dtype=kind, device=device)
    memory = np.empty(count, np.int32 if kind is int else wp.dtype_to_numpy(kind))
    return wp.array(memory, dtype=kind, device=device, copy=False)


def empty_for_results(shape: tuple[int, ...], device: wp.DeviceLike) -> wp.array:
    """Return an array of vec3 in CPU memory for a device's results: pinned for a GPU, for faster transfers."""
    if wp.get_device(device).is_cpu:
        return empty_vectors(shape, "cpu")
    return wp.empty(shape, dtype=wp.vec3, device="cpu", pinned=True)
