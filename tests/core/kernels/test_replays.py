# SPDX-License-Identifier: GPL-3.0-or-later
"""Replayed launches equal new launches with the current contents of arrays."""

import numpy as np
import pytest
import warp as wp

from hair_addon.core.kernels import kernel_cache
from hair_addon.core.kernels.replays import Replays

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _add(values: wp.array[float], factor: float, sums: wp.array[float]):
    index = wp.tid()
    sums[index] += factor * values[index]


class Sums:
    """Sums of values by two launches, whose only identification for `Replays` is the factor."""

    def __init__(self, device):
        self.device, self.replays = wp.get_device(device), Replays(device)
        self.values, self.sums = (wp.zeros(3, dtype=float, device=device) for _ in range(2))
        self.launch_count = 0

    def add(self, values, factor):
        self.values.assign(np.asarray(values, np.float32))

        def launch():
            self.launch_count += 1
            for _ in range(2):
                kernel_cache.launch(_add, 3, [self.values, factor], [self.sums], self.device)

        self.replays.run(factor, launch)
        return self.sums.numpy()


def test_arrays_may_hold_other_values_each_time(device):
    sums, expected = Sums(device), np.zeros(3)
    for step in range(6):
        for factor in (1.0, 0.5):
            expected += 2.0 * factor * np.array([step, 1.0, -step])
            np.testing.assert_array_equal(sums.add([step, 1.0, -step], factor), expected)
    assert sums.launch_count == (12 if sums.device.is_cpu else 4)


def test_more_keys_than_are_kept(device):
    sums, expected = Sums(device), 0.0
    for _ in range(2):
        for factor in range(100):
            expected += 2.0 * factor
            assert sums.add([1.0, 1.0, 1.0], float(factor))[0] == expected


def test_an_error_while_recording_is_raised_and_the_next_launch_runs(device):
    sums = Sums(device)
    sums.add([1.0, 1.0, 1.0], 1.0)

    def fail():
        raise ValueError("no array")

    with pytest.raises(ValueError, match="no array"):
        sums.replays.run(1.0, fail)
    assert sums.add([1.0, 1.0, 1.0], 1.0)[0] == 4.0
    assert sums.add([1.0, 1.0, 1.0], 1.0)[0] == 6.0
