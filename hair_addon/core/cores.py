# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels on all cores of the processor, and memory that is quick to fill.

A launch of Warp on the processor is a loop on one core, during which Python's other threads may run: so rows are shared
out among threads, each with a launch of its own. No row depends on another, so results do not depend on how many.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import warp as wp

PARTS_PER_CORE = 2  # one core may have other work: then another takes over what it leaves


@dataclass(frozen=True)
class Rows:
    """An array of which thread i of a kernel touches row i alone."""

    array: wp.array


def launch(kernel, row_count, inputs, outputs, device, least_rows=4096):
    """Run a kernel, a thread a row. inputs: `Rows`, and whatever threads share; outputs: arrays of rows.

    least_rows: fewer are not worth a thread of the processor.
    """
    device = wp.get_device(device)
    core_count = os.process_cpu_count() if device.is_cpu else 1
    part_count = min(core_count * PARTS_PER_CORE, row_count // least_rows) if core_count > 1 else 1
    given = [*inputs, *map(Rows, outputs)]

    def run(first, end):
        arguments = [value.array[first:end] if isinstance(value, Rows) else value for value in given]
        wp.launch(kernel, dim=end - first, inputs=arguments, device=device)

    if part_count < 2:
        whole = [value.array if isinstance(value, Rows) else value for value in given]
        wp.launch(kernel, dim=row_count, inputs=whole, device=device)
        return
    wp.force_load(device, [kernel.module])  # once, not by each thread: microseconds where it is there
    bounds = np.linspace(0, row_count, part_count + 1).astype(int).tolist()
    with ThreadPoolExecutor(min(core_count, part_count)) as pool:
        list(pool.map(run, bounds[:-1], bounds[1:]))  # where the first exception is raised again


def empty_vectors(shape, device):
    """`wp.empty` of vec3; on the processor in NumPy's memory, which comes in large pages: filling it takes a third."""
    device = wp.get_device(device)
    if not device.is_cpu:
        return wp.empty(shape, dtype=wp.vec3, device=device)
    return wp.array(np.empty((*shape, 3), np.float32), dtype=wp.vec3, device=device, copy=False)


def empty_for_results(shape, device):
    """An array of vec3 in the processor's memory for a device's results: pinned, which a GPU fills faster."""
    if wp.get_device(device).is_cpu:
        return empty_vectors(shape, "cpu")
    return wp.empty(shape, dtype=wp.vec3, device="cpu", pinned=True)
