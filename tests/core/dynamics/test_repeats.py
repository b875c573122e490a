# SPDX-License-Identifier: GPL-3.0-or-later
"""The same strands move alike, bit by bit: again, resumed, in another order, on other numbers of threads."""

import os

import numpy as np
import pytest
import warp as wp

from hair_addon.core.dynamics import rod_solver
from tests.support.devices import DEVICE
from tests.support.rods import Simulation, curl, in_lanes, line

COUNT, VERTICES = 150, 12  # more than one share of two threads
FRAMES = 4


@pytest.fixture
def groom(rng):
    shapes = np.concatenate([line(0.1, VERTICES), curl(0.1, VERTICES, 1)])
    shapes = shapes[rng.integers(0, 2, COUNT)] * rng.uniform(0.3, 2.0, (COUNT, 1, 1))
    return shapes + rng.normal(scale=0.05, size=(COUNT, 1, 3))


def shaken(groom, frames=FRAMES, simulation=None, first_frame=0, **details):
    """The state after some frames, near a floor."""
    simulation = Simulation(groom) if simulation is None else simulation
    for frame in range(first_frame, frames):
        simulation.roots = groom[:, 0] + 0.02 * np.sin([frame, 2.0 * frame, 0.5 * frame])
        simulation.advance(surroundings=floor(groom), **details)
    return simulation.rods.save()


def floor(groom):
    """A plane of contact below the middle of all roots, of strands that start on the far side none."""
    planes = np.zeros((len(groom), VERTICES, rod_solver.PLANE_ROWS))
    planes[groom[:, 0, 1] < 0.03] = [0.0, 0.0, 1.0, -0.02, 0.0, 0.0, 0.0, 0.3]
    return rod_solver.Surroundings(planes=in_lanes(planes))


def assert_equal(state, other):
    assert state.keys() == other.keys()
    for name in state:
        np.testing.assert_array_equal(state[name], other[name], err_msg=name)


def test_again(groom):
    state = shaken(groom)
    assert np.isfinite(state["positions"]).all()
    assert_equal(state, shaken(groom))


@pytest.mark.parametrize("frame", range(1, FRAMES))
def test_resumed_from_any_frame(groom, frame):
    resumed = Simulation(groom)
    resumed.rods.load(shaken(groom, frame))
    assert_equal(shaken(groom), shaken(groom, simulation=resumed, first_frame=frame))


def test_in_another_order(groom, rng):
    """No strand depends on those whose lanes are beside its own; also not on how many there are."""
    order = rng.permutation(COUNT)[: COUNT - 11]
    state, other = shaken(groom), shaken(groom[order])
    for name in state.keys() - {"step_size"}:
        np.testing.assert_array_equal(state[name][order], other[name], err_msg=name)


@pytest.mark.parametrize("core_count", [1, 2, 5])
def test_on_other_numbers_of_threads(groom, monkeypatch, core_count):
    state = shaken(groom)
    monkeypatch.setattr(os, "process_cpu_count", lambda: core_count)
    assert_equal(state, shaken(groom))


def test_stage_by_stage_and_substep_by_substep(groom):
    def advance_in_parts(simulation):
        for substep in range(simulation.step.count):
            for stage in (rod_solver.PREDICT, rod_solver.SOLVE, rod_solver.FINISH):
                simulation.rods.advance(simulation.step, substep, substep + 1, stage, floor(groom))

    simulation = Simulation(groom)
    for frame in range(FRAMES):
        simulation.rods.move_roots(groom[:, 0] + 0.02 * np.sin([frame, 2.0 * frame, 0.5 * frame]))
        advance_in_parts(simulation)
    assert_equal(shaken(groom), simulation.rods.save())


@pytest.mark.skipif(wp.get_device(DEVICE).is_cpu, reason="threads of a GPU stand in blocks")
def test_in_blocks_of_any_size(groom):
    assert_equal(shaken(groom), shaken(groom, block_dim=128))


@pytest.mark.skipif(wp.get_device(DEVICE).is_cpu, reason="needs both kinds of device")
def test_on_both_kinds_of_device(groom):
    lengths = np.linalg.norm(np.diff(groom, axis=1), axis=2).sum(axis=1)
    points = []
    for device in ("cpu", DEVICE):
        simulation = Simulation(groom, device=device)
        for frame in range(24):
            simulation.roots = groom[:, 0] + 0.02 * np.sin([frame, 2.0 * frame, 0.5 * frame])
            simulation.advance()
        points.append(simulation.points)
    moved = np.linalg.norm(points[1] - points[0], axis=2).max(axis=1)
    assert (moved < 1e-5 * lengths).all()
