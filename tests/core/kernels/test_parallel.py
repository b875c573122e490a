# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels give the same results on all cores as on one core."""

import os
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import warp as wp

from hair_addon.core.kernels import parallel
from hair_addon.core.kernels.parallel import Rows
from tests.support.devices import DEVICE

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _scale(
    values: wp.array2d[float],
    factors: wp.array[float],
    # outputs
    out_values: wp.array2d[float],
    out_sums: wp.array[float],
):
    row = wp.tid()
    total = float(0.0)
    for column in range(values.shape[1]):
        out_values[row, column] = factors[column] * values[row, column]
        total += out_values[row, column]
    out_sums[row] = total


@pytest.mark.parametrize("row_count", [0, 1, 7, 4096, 50_001])
@pytest.mark.parametrize("core_count", [1, 2, 5])
def test_rows_are_computed_once_each_on_any_number_of_cores(rng, monkeypatch, row_count, core_count):
    monkeypatch.setattr(os, "process_cpu_count", lambda: core_count)
    values, factors = rng.random((row_count, 3), np.float32), np.float32([1.0, 2.0, 4.0])
    there = wp.array(values, dtype=float, device=DEVICE, ndim=2)
    out_values, out_sums = wp.zeros_like(there), wp.zeros(row_count, dtype=float, device=DEVICE)
    given = [Rows(there), wp.array(factors, dtype=float, device=DEVICE)]
    parallel.launch(_scale, row_count, inputs=given, outputs=[out_values, out_sums], device=DEVICE)
    np.testing.assert_array_equal(out_values.numpy(), factors * values)
    np.testing.assert_allclose(out_sums.numpy(), (factors * values).sum(axis=1), rtol=1e-6)


@pytest.mark.parametrize("core_count", [1, 2, 5])
def test_the_start_of_kernels_is_signaled_once(rng, monkeypatch, core_count):
    """The signal comes before any row is done, and results are the same."""
    monkeypatch.setattr(os, "process_cpu_count", lambda: core_count)
    values = wp.array(rng.random((50_001, 3), np.float32), dtype=float, device=DEVICE, ndim=2)
    factors = wp.array(np.float32([1.0, 2.0, 4.0]), dtype=float, device=DEVICE)
    outputs = [wp.zeros_like(values), wp.zeros(len(values), dtype=float, device=DEVICE)]
    begun = []

    def under_way():
        begun.append(bool(outputs[1].numpy().all()))

    parallel.launch(_scale, len(values), [Rows(values), factors], outputs, DEVICE, under_way=under_way)
    assert begun == [False]
    np.testing.assert_array_equal(outputs[0].numpy(), factors.numpy() * values.numpy())


@pytest.mark.parametrize("row_count", [0, 1, 50_001])
def test_a_launch_on_one_core_pauses_before_its_first_and_between_its_rows(rng, row_count):
    """A launch on one core pauses before its first row and between rows with the same results; an exception of a
    pause ends it.
    """
    values, factors = rng.random((row_count, 3), np.float32), np.float32([1.0, 2.0, 4.0])
    there = wp.array(values, dtype=float, device="cpu", ndim=2)
    given = [Rows(there), wp.array(factors, dtype=float, device="cpu")]
    out_values, out_sums = wp.zeros_like(there), wp.zeros(row_count, dtype=float, device="cpu")
    done = []  # rows at each pause
    with parallel.on_one_core(lambda: done.append(int(np.count_nonzero(out_sums.numpy())))):
        parallel.launch(_scale, row_count, given, [out_values, out_sums], "cpu")
    np.testing.assert_array_equal(out_values.numpy(), factors * values)
    assert done[:1] == [0][: len(done)] and (row_count < 2 or 0 < done[1] < row_count)
    if row_count < 2:
        return
    out_sums.zero_()

    def end():
        if out_sums.numpy().any():
            raise InterruptedError

    with pytest.raises(InterruptedError), parallel.on_one_core(end):
        parallel.launch(_scale, row_count, given, [out_values, out_sums], "cpu")
    assert not out_sums.numpy().all()
    parallel.launch(_scale, row_count, given, [out_values, out_sums], "cpu")  # without pauses
    assert out_sums.numpy().all()


def test_no_thread_is_left(rng):
    before = {*threading.enumerate()}
    test_rows_are_computed_once_each_on_any_number_of_cores(rng, pytest.MonkeyPatch(), 50_001, 2)
    assert before.issuperset(threading.enumerate())


def test_what_goes_wrong_in_a_part_is_raised():
    wrong = wp.zeros(50_000, dtype=wp.vec3, device="cpu")
    with pytest.raises(RuntimeError):
        parallel.launch(_scale, 50_000, inputs=[Rows(wrong), wrong], outputs=[wrong, wrong], device="cpu")


def test_empty_vectors_have_their_shape():
    assert parallel.empty_vectors((5, 4), DEVICE).shape == (5, 4)
    assert parallel.empty_vectors((5, 4), DEVICE).dtype is wp.vec3


@pytest.mark.parametrize("failing", [0, 3])
def test_what_any_thread_raises_is_raised_when_all_are_done(failing):
    done = []

    def run(part):
        if part == failing:
            raise ValueError("this part")
        done.append(part)

    with pytest.raises(ValueError, match="this part"):
        parallel._on_threads(run, 4, 2)
    assert failing not in done


def test_on_one_core_only_the_calling_thread_has_a_single_part():
    """On one core only the calling thread has a single part; later, and in other threads, shares are as before."""
    usual = parallel.part_count(1_000_000, "cpu")
    with ThreadPoolExecutor(1) as pool, parallel.on_one_core():
        assert parallel.part_count(1_000_000, "cpu") == parallel.share_count(1_000_000, "cpu") == 1
        assert pool.submit(parallel.part_count, 1_000_000, "cpu").result() == usual
    assert parallel.part_count(1_000_000, "cpu") == usual
