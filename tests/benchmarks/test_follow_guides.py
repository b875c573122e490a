# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of `follow_guides`, which runs in each step of combing, compared with filling as much memory, on every
device.
"""

import time

import numpy as np
import pytest
import warp as wp

from hair_addon.core.grooming import following, groom
from tests.support.meshes import HEAD, read_obj


def devices():
    return ["cpu", *(str(device) for device in wp.get_cuda_devices())]


def median_time(work, device, repetitions=9):
    """Return the median time [s] of a call with the device's work, after a first call that compiles."""
    times = []
    for _ in range(repetitions + 1):
        wp.synchronize_device(device)
        started = time.perf_counter()
        work()
        wp.synchronize_device(device)
        times.append(time.perf_counter() - started)
    return float(np.median(times[1:]))


@pytest.mark.long
@pytest.mark.parametrize("strand_count", [30_000, 100_000, 1_000_000])
@pytest.mark.parametrize("device", devices())
def test_follow_guides(strand_count, device):
    """On a GPU, following guides takes less than twice as long as filling the same memory; all times are printed."""
    head = read_obj(HEAD)
    density = np.clip((head.vertices[:, 2] - 0.755) / 0.01, 0.0, 1.0)
    guides = groom.distribute_guides(head, groom.GuideSettings(), density=density, device=device)
    settings = groom.HairSettings(strand_count=strand_count)
    binding = groom.bind_hair(head, guides, settings, density=density, device=device)
    weights = following.weights_now(binding, guides)
    on_host = following.growing_points(binding, guides, weights).result()
    points = wp.empty((strand_count, groom.POINT_COUNT), dtype=wp.vec3, device=device)
    ways = {
        "bind": lambda: groom.bind_hair(head, guides, settings, density=density, device=device),
        "follow": lambda: following.follow_guides(binding, guides),
        "follow, to the host": lambda: following.growing_points(binding, guides, weights, out=on_host).result(),
        "fill as much": lambda: points.fill_(wp.vec3(1.0, 2.0, 3.0)),
    }
    times = {name: median_time(way, device) for name, way in ways.items()}
    print(f"\n{strand_count:9} strands, {device:7}", *(f"  {name} {1e3 * t:8.3f} ms" for name, t in times.items()))
    if device != "cpu" and strand_count == 1_000_000:
        assert times["follow"] < 2.0 * times["fill as much"]
