# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of baking 256 × 256 tables of all lobes, by NumPy and by Warp on the processor and on GPUs."""

import time

import numpy as np
import pytest
import warp as wp

from hair_addon.core.shading import appearance
from hair_addon.core.shading.tables import absorption_slices, lookup_tables, strand_tables

MODES = ["classic", "energy"]


def median_time(way, repetitions=7):
    """Return the median time [s] after a first call, which compiles."""
    way()
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        way()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def devices():
    return ["cpu", *(str(device) for device in wp.get_cuda_devices())]


@pytest.mark.long
@pytest.mark.parametrize("mode", MODES)
def test_bake(mode):
    """Tables are baked in both modes and as slices; times and their ratio to NumPy's are printed."""
    settings = lookup_tables.Settings(mode=mode)
    varied = appearance.strand_settings(appearance.Appearance(random_color=0.5, tip_absorption=0.5))
    numpy_time = median_time(lambda: lookup_tables.bake(settings))
    for device in devices():
        tables = median_time(lambda device=device: lookup_tables.bake(settings, device))
        slices = median_time(lambda device=device: absorption_slices.bake(settings, (0.0, 9.0), device=device), 3)
        strands = median_time(lambda device=device: strand_tables.bake(settings, varied, device), 3)
        name = "NumPy" if device == "cpu" else device
        print(f"\n{mode:8} {name:8} tables {1e3 * tables:7.1f} ms  {tables / numpy_time:5.2f} × NumPy", end="")
        print(f"   {absorption_slices.SLICE_COUNT} slices {1e3 * slices:7.1f} ms", end="")
        print(f"   strands that differ {1e3 * strands:7.1f} ms", end="")
