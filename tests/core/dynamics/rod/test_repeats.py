# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulations are reproducible bit by bit: repeated, resumed, in another order, with other numbers of threads."""

import os
from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from hair_addon.core.dynamics.rod import rod_solver
from tests.support.devices import DEVICE
from tests.support.dynamics.rods import Simulation, curl, in_lanes, line

COUNT, VERTICES = 150, 12  # more than one share of two threads
FRAMES = 4


@pytest.fixture
def groom(rng):
    shapes = np.concatenate([line(0.1, VERTICES), curl(0.1, VERTICES, 1)])
    shapes = shapes[rng.integers(0, 2, COUNT)] * rng.uniform(0.3, 2.0, (COUNT, 1, 1))
    return shapes + rng.normal(scale=0.05, size=(COUNT, 1, 3))


def shaken(groom, frames=FRAMES, simulation=None, first_frame=0, **details):
    """Return the state after some frames near a floor."""
    simulation = Simulation(groom) if simulation is None else simulation
    for frame in range(first_frame, frames):
        simulation.roots = groom[:, 0] + 0.02 * np.sin([frame, 2.0 * frame, 0.5 * frame])
        simulation.advance(surroundings=floor(groom), **details)
    return simulation.rods.save()


def floor(groom):
    """Return a contact plane below the middle of all roots; strands on its far side have none."""
    planes = np.zeros((len(groom), VERTICES, rod_solver.PLANE_ROWS))
    planes[groom[:, 0, 1] < 0.03] = [0.0, 0.0, 1.0, -0.02, 0.0, 0.0, 0.0, 0.3]
    return rod_solver.Surroundings(planes=in_lanes(planes))


def assert_equal(state, other):
    assert state.keys() == other.keys()
    for name in state:
        np.testing.assert_array_equal(state[name], other[name], err_msg=name)


@pytest.mark.gate(id="V13")
def test_again(groom):
    state = shaken(groom)
    assert np.isfinite(state["positions"]).all()
    assert_equal(state, shaken(groom))


@pytest.mark.gate(id="V13")
@pytest.mark.parametrize("frame", range(1, FRAMES))
def test_resumed_from_any_frame(groom, frame):
    resumed = Simulation(groom)
    resumed.rods.load(shaken(groom, frame))
    assert_equal(shaken(groom), shaken(groom, simulation=resumed, first_frame=frame))


@pytest.mark.gate(id="V13")
def test_in_another_order(groom, rng):
    """Strands have the same bits in another order, whatever strands are in the lanes beside them and however many."""
    order = rng.permutation(COUNT)[: COUNT - 11]
    state, other = shaken(groom), shaken(groom[order])
    for name in state.keys() - {"step_size"}:
        np.testing.assert_array_equal(state[name][order], other[name], err_msg=name)


@pytest.mark.gate(id="V13")
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


@pytest.mark.gate(id="V19")
def test_at_other_frame_rates(groom):
    """Substeps of one size in 24, 30 and 60 frames per second give the same motion above resting roots."""
    ends = []
    for count in (10, 8, 4):
        simulation = Simulation(groom)
        simulation.step = replace(simulation.step, size=1.0 / 240.0, count=count)
        ends.append(simulation.advance(240 // 3 // count).points)
    np.testing.assert_array_equal(ends[1], ends[0])
    np.testing.assert_array_equal(ends[2], ends[0])


def test_carried_strands_go_on_as_before(groom):
    """Strands carried by a jump continue as before, as gravity, roots and motion turn with the jump."""
    turn = Rotation.from_rotvec([0.5, -1.0, 0.3])
    here, there = Simulation(groom).advance(3), Simulation(groom).advance(3)
    chosen = np.arange(COUNT) % 3 == 0
    places = groom[:, 0] + [0.3, -0.2, 0.1]
    turns = np.tile(turn.as_quat(), (COUNT, 1))
    there.rods.carry(chosen, turns, groom[:, 0], places)
    there.step = replace(there.step, gravity=tuple(turn.apply(there.step.gravity)))
    there.roots = np.where(chosen[:, None], places, groom[:, 0])
    there.turns = np.where(chosen[:, None], turns, [0.0, 0.0, 0.0, 1.0])
    here.advance(3), there.advance(3)
    back = turn.inv().apply((there.points - there.roots[:, None])[chosen].reshape(-1, 3))
    stayed = (here.points - groom[:, :1])[chosen].reshape(-1, 3)
    assert abs(back - stayed).max() < 1e-5
    there = Simulation(groom).advance(3)
    there.rods.carry(chosen, turns, groom[:, 0], places)
    here = Simulation(groom).advance(3)
    np.testing.assert_array_equal(there.rods.save()["frames"][~chosen], here.rods.save()["frames"][~chosen])


@pytest.mark.gate(id="V13")
@pytest.mark.skipif(wp.get_device(DEVICE).is_cpu, reason="threads of a GPU stand in blocks")
def test_in_blocks_of_any_size(groom):
    assert_equal(shaken(groom), shaken(groom, block_dim=128))


@pytest.mark.gate(id="V13")
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
