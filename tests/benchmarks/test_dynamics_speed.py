# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated strands of 25 points: beside Blender's Hair Dynamics, and on a ball beside none, in one run."""

import os

import bpy
import numpy as np
import pytest
import warp as wp

from hair_addon.core.dynamics import rod_solver
from tests.benchmarks.test_hair_speed import best_times, report
from tests.support.rod_contact import Ball, advance_touching, planes_of
from tests.support.rods import FRAME, Simulation, in_lanes, line

ASSETS = "/geometry_nodes_dynamics_assets.blend"
POINTS, LENGTH = 25, 0.15
OURS = "ours, 4 substeps"


def strands(count):
    """(count, 25, 3): level strands of 15 cm, their roots apart."""
    roots = np.random.default_rng(0).normal(scale=0.05, size=(count, 1, 3))
    return line(LENGTH, POINTS) + roots


def shaken(simulation):
    """A call that simulates the next frame of shaken roots."""
    frames = iter(range(10**6))

    def advance():
        simulation.roots = simulation.groom[:, 0] + [0.02 * np.sin(2.0 * np.pi * FRAME * next(frames)), 0.0, 0.0]
        simulation.advance()

    return advance


class HairDynamics:
    """Blender's own, as it is added, in the mode that simulates."""

    def __init__(self, points):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        data = bpy.data.hair_curves.new("Hair")
        data.add_curves([points.shape[1]] * len(points))
        data.points.foreach_set("position", points.astype(np.float32).ravel())
        self.hair = bpy.data.objects.new("Hair", data)
        bpy.context.scene.collection.objects.link(self.hair)
        folder = bpy.utils.system_resource("DATAFILES", path="assets/nodes")
        with bpy.data.libraries.load(folder + ASSETS, link=False) as (_there, here):
            here.node_groups = ["Hair Dynamics"]
        modifier = self.hair.modifiers.new("Dynamics", "NODES")
        modifier.node_group = bpy.data.node_groups["Hair Dynamics"]
        sockets = modifier.node_group.interface.items_tree
        mode = next(socket for socket in sockets if socket.name == "Mode" and socket.in_out == "INPUT")
        getattr(modifier.properties.inputs, mode.identifier).value = "Physics (Experimental)"
        self.frame = 1

    def advance(self):
        """The next frame."""
        bpy.context.scene.frame_set(self.frame)
        self.frame += 1

    def stretch(self):
        """Mean over all segments."""
        evaluated = self.hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        points = np.empty(3 * len(evaluated.points), np.float32)
        evaluated.points.foreach_get("position", points)
        sizes = np.linalg.norm(np.diff(points.reshape(-1, POINTS, 3), axis=1), axis=2)
        return sizes.mean() / (LENGTH / (POINTS - 1)) - 1.0


@pytest.mark.long
def test_a_frame_beside_blenders():
    """1,000 strands for a second each; both stretches are printed."""
    points = strands(1000)
    simulation, peer = Simulation(points), HairDynamics(points)
    calls = {OURS: shaken(simulation), "Hair Dynamics": peer.advance}
    for call in calls.values():
        call()  # compiles
    ratios = report("Dynamics, a frame", 1000, best_times(calls, 24), {"Hair Dynamics": 60}, OURS)
    print(f"stretch: ours {abs(simulation.rods.stretch()).max():.1e}, Hair Dynamics {peer.stretch():.2f}")
    assert ratios["Hair Dynamics"].work > 60.0
    assert abs(simulation.rods.stretch()).max() < 1e-4


@pytest.mark.long
def test_four_thousand_strands(monkeypatch):
    """By the time that copying their state takes; on two threads too, whose gain is printed."""
    simulation = Simulation(strands(4000))
    arrays = vars(simulation.rods.arrays).values()
    copies = [wp.clone(array) for array in arrays]
    advance = shaken(simulation)

    def on(core_count):
        def call():
            monkeypatch.setattr(os, "process_cpu_count", lambda: core_count)
            advance()

        return call

    def copy():
        for there, array in zip(copies, arrays, strict=True):
            wp.copy(there, array)

    advance()
    calls = {"one thread": on(1), "two threads": on(2), "copying the state": copy}
    times = best_times(calls, 15)
    report("Dynamics, free", 4000, times, {"two threads": "1 / 1.7"}, "one thread")
    joint = times["one thread"].work / (4000 * (POINTS - 1) * simulation.step.count)
    print(f"{1e9 * joint:.1f} ns a joint and substep, asked: 46; goal of a frame: 20 ms")
    assert times["one thread"].work < 40.0 * times["copying the state"].work


@pytest.mark.long
def test_touching_costs_little():
    """The solve of strands that lie on a ball, beside the same strands that have no planes."""
    rng = np.random.default_rng(0)
    out = rng.normal(size=(1024, 1, 3))
    out[..., 2] = abs(out[..., 2]) + 0.2
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    groom = 0.0507 * out + out * [1.0, 1.0, 0.2] * np.linspace(0.0, LENGTH, POINTS)[:, None]
    simulation, ball = Simulation(groom), Ball(0.05)
    advance_touching(simulation, ball, 24)
    simulation.rods.advance(simulation.step, 0, 1, rod_solver.PREDICT)
    state = simulation.rods.save()
    around = rod_solver.Surroundings(in_lanes(planes_of(ball, simulation.points, 5e-4, 0.3)))

    def solve(surroundings):
        simulation.rods.load(state)
        simulation.rods.advance(simulation.step, 0, 1, rod_solver.SOLVE, surroundings)

    calls = {
        "free": lambda: solve(rod_solver.EMPTY),
        "touching": lambda: solve(around),
        "neither": lambda: simulation.rods.load(state),
    }
    times = best_times(calls, 15)
    report("Dynamics, contact", 1024, times, {"touching": 2}, "free")
    loading = times["neither"].work
    assert times["touching"].work - loading < 2.0 * (times["free"].work - loading)
