# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of simulated strands of 25 points, free and in contact, compared with Blender's Hair Dynamics."""

import contextlib
import functools
import os
import time

import bpy
import gpu
import numpy as np
import pytest
import warp as wp

import hair_addon
from hair_addon.blender.groom import bindings
from hair_addon.blender.groom.dynamics import guide_simulation
from hair_addon.blender.host import running
from hair_addon.blender.live import invalidation, live_hair, simulated_hair
from hair_addon.blender.settings import preferences
from hair_addon.core.dynamics import root_motion, simulation
from hair_addon.core.dynamics.rod import rod_solver, rotations
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.geometry.mesh import TriMesh
from hair_addon.core.geometry.sampling import sample_surface
from tests.benchmarks.rods_in_warp import NewtonStep
from tests.benchmarks.test_hair_speed import Time, best_times, report
from tests.benchmarks.test_live_editing import View, on_gpu
from tests.support.devices import DEVICE
from tests.support.dynamics.rod_contact import Ball, advance_touching, planes_of
from tests.support.dynamics.rods import FRAME, Simulation, in_lanes, line
from tests.support.dynamics.shaken_head import grown, shake
from tests.support.meshes import HEAD, read_obj

ASSETS = "/geometry_nodes_dynamics_assets.blend"
POINTS, LENGTH = 25, 0.15
OURS = "ours, 4 substeps"


def strands(count):
    """Return (count, 25, 3): level strands of 15 cm with separate roots."""
    roots = np.random.default_rng(0).normal(scale=0.05, size=(count, 1, 3))
    return line(LENGTH, POINTS) + roots


def shaken(simulation):
    """Return a function that simulates the next frame of shaken roots."""
    frames = iter(range(10**6))

    def advance():
        simulation.roots = simulation.groom[:, 0] + [0.02 * np.sin(2.0 * np.pi * FRAME * next(frames)), 0.0, 0.0]
        simulation.advance()

    return advance


class HairDynamics:
    """Blender's Hair Dynamics with default settings, in the mode that simulates."""

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
        """Simulate the next frame."""
        bpy.context.scene.frame_set(self.frame)
        self.frame += 1

    def stretch(self):
        """Return the mean stretch of all segments."""
        evaluated = self.hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        points = np.empty(3 * len(evaluated.points), np.float32)
        evaluated.points.foreach_get("position", points)
        sizes = np.linalg.norm(np.diff(points.reshape(-1, POINTS, 3), axis=1), axis=2)
        return sizes.mean() / (LENGTH / (POINTS - 1)) - 1.0


@pytest.mark.long
def test_a_frame_beside_blenders():
    """A frame of 1,000 strands is compared with Blender's over a second; the stretch of both is printed."""
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
    """A frame of 4,000 strands is compared with copying their state; the gain of a second thread is printed."""
    simulation = Simulation(strands(4000))
    arrays = [getattr(simulation.rods.arrays, name) for name in rod_solver.ROWS]
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
def test_lanes_beside_warps_vectors(monkeypatch):
    """A whole substep in lanes is compared with one Newton step by the same algebra in Warp's vectors, on one
    thread.
    """
    monkeypatch.setattr(os, "process_cpu_count", lambda: 1)
    simulation = Simulation(strands(1000), damping_time=0.0)
    simulation.advance(3)
    simulation.rods.advance(simulation.step, 0, 1, rod_solver.PREDICT)
    in_warp = NewtonStep(simulation.rods, simulation.step)
    predicted = in_warp.positions.numpy().copy()
    in_warp.solve()
    simulation.rods.advance(simulation.step, 0, 1, rod_solver.SOLVE | rod_solver.FINISH)
    moved = np.abs(simulation.rods.positions() - predicted).max()
    assert np.abs(in_warp.positions.numpy() - simulation.rods.positions()).max() < 1e-3 * moved  # the same algebra
    calls = {"lanes": lambda: simulation.rods.advance(simulation.step, 0, 1), "Warp's vectors": in_warp.solve}
    times = best_times(calls, 15)
    ratios = report("Dynamics, a substep", 1000, times, {"Warp's vectors": 8}, "lanes")
    joints = 1000 * (POINTS - 1)
    print(f"ns a joint: {', '.join(f'{name} {1e9 * found.work / joints:.0f}' for name, found in times.items())}")
    assert ratios["Warp's vectors"].work > 4.0


@pytest.mark.long
def test_touching_costs_little():
    """Solving strands that lie on a ball takes little longer than solving the same strands without contact planes."""
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


def finer(mesh):
    """Return a mesh whose triangles are split in four."""
    corners = mesh.vertices[mesh.triangles]
    middles = (corners + np.roll(corners, -1, axis=1)) / 2.0
    (a, b, c), (ab, bc, ca) = np.moveaxis(corners, 1, 0), np.moveaxis(middles, 1, 0)
    parts = np.concatenate([np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    vertices, triangles = np.unique(parts.reshape(-1, 3), axis=0, return_inverse=True)
    return TriMesh(vertices.astype(np.float32), triangles.reshape(-1, 3).astype(np.int32))


class LyingOnHead:
    """4,000 soft guides that lie on the sample head, in 8 substeps: free, or colliding while it is still or shaken."""

    def __init__(self, head, is_colliding, is_shaken):
        guides = grown(head, 4000)
        self.head, self.is_colliding, self.is_shaken, self.frame = head, is_colliding, is_shaken, 0
        self.pose = root_motion.RootPose(guides[:, 0], np.tile(rotations.IDENTITY, (len(guides), 1)))
        settings = DynamicsSettings(
            bend_stiffness=1.0, hair_friction=0.0, hair_pressure=0.0, automatic_substeps=False, substeps=8
        )
        self.simulation = simulation.Simulation(guides, settings, self.pose, self.world(shake(0)))

    def world(self, motion):
        """Return the world at the head's position."""
        head = simulation.Obstacle("Head", self.head.vertices.astype(np.float64), self.head.triangles)
        return simulation.World(obstacles=(head.moved(motion),) if self.is_colliding else ())

    def advance(self):
        """Simulate the next frame."""
        self.frame += 1
        motion = shake(self.frame if self.is_shaken else 0)
        self.simulation.advance(self.pose.moved(motion), self.world(motion), FRAME)


@pytest.mark.long
def test_four_thousand_guides_that_lie_on_a_head():
    """The cost of contact is printed for guides of which a dozen points each touch the head."""
    head = finer(read_obj(HEAD))
    ways = {"free": (False, True), "still": (True, False), "shaken": (True, True)}
    ways = {name: LyingOnHead(head, *way) for name, way in ways.items()}
    for _ in range(8):
        for way in ways.values():
            way.advance()
    times = best_times({name: way.advance for name, way in ways.items()}, 8)
    report("Dynamics, lying on a head", 4000, times, {}, "free")
    assert times["still"].work < times["shaken"].work < 60.0 * times["free"].work


class OnHead:
    """4,000 guides on the scalp of the sample head: free, or colliding with it while it is still or turns at 1.5 Hz."""

    def __init__(self, head, is_colliding, is_turning):
        scalp = np.clip((head.vertices[:, 2] - 0.755) / 0.01, 0.0, 1.0)
        roots = sample_surface(head, 4000, seed=0, density=scalp)
        places = np.einsum("nc,ncx->nx", roots.barycentric, head.corners[roots.triangle]).astype(np.float64)
        a, b, c = np.moveaxis(head.corners[roots.triangle], 1, 0)
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        t = np.linspace(0.0, LENGTH, 41)[:, None]
        groom = places[:, None] + t * normals[:, None]
        self.head, self.is_colliding, self.is_turning = head, is_colliding, is_turning
        self.pose = root_motion.RootPose(places, np.tile(rotations.IDENTITY, (len(places), 1)))
        settings = DynamicsSettings(hair_friction=0.0, hair_pressure=0.0, automatic_substeps=False, substeps=4)
        self.frame, still = 0, root_motion.RigidMotion(rotations.IDENTITY, np.zeros(3), np.zeros(3))
        self.simulation = simulation.Simulation(groom, settings, self.pose, self.world(still))

    def world(self, motion):
        """Return the world at the head's position."""
        head = simulation.Obstacle("Head", self.head.vertices.astype(np.float64), self.head.triangles)
        return simulation.World(obstacles=(head.moved(motion),) if self.is_colliding else ())

    def advance(self):
        """Simulate the next frame."""
        self.frame += 1
        angle = 0.5 * np.sin(2.0 * np.pi * 1.5 * FRAME * self.frame) if self.is_turning else 0.0
        turn = np.array([0.0, 0.0, np.sin(angle / 2.0), np.cos(angle / 2.0)])
        motion = root_motion.RigidMotion(turn, np.array([0.0, -0.06, 0.75]), np.zeros(3))
        self.simulation.advance(self.pose.moved(motion), self.world(motion), FRAME)


@pytest.mark.long
def test_four_thousand_guides_on_a_head():
    """The cost of contact is printed for upright guides that swing on 34,000 triangles."""
    head = finer(read_obj(HEAD))
    ways = {"free": OnHead(head, False, True), "still": OnHead(head, True, False), "turning": OnHead(head, True, True)}
    for _ in range(12):
        for way in ways.values():
            way.advance()
    times = best_times({name: way.advance for name, way in ways.items()}, 12)
    report("Dynamics, on a head", 4000, times, {"still": 2, "turning": 4}, "free")
    assert times["still"].work < 2.5 * times["free"].work
    assert times["still"].work < times["turning"].work < 6.0 * times["free"].work


class Parts:
    """The time that chosen functions take within a frame."""

    def __init__(self, monkeypatch):
        self._patch = monkeypatch
        self.times = {}

    def watch(self, name, owner, function):
        """Add the time of each call of a module's or class's function."""
        called = getattr(owner, function)

        @functools.wraps(called)
        def timed(*given, **options):
            with self.of(name):
                return called(*given, **options)

        self._patch.setattr(owner, function, timed)

    @contextlib.contextmanager
    def of(self, name):
        """Add the time of a block."""
        clock, work = time.perf_counter(), time.process_time()
        yield
        spent = self.times.setdefault(name, [])
        spent.append(Time(time.perf_counter() - clock, time.process_time() - work))

    def medians(self):
        """Return {name: `Time`} of medians."""
        return {
            name: Time(*(float(np.median([getattr(t, kind) for t in spent])) for kind in ("clock", "work")))
            for name, spent in self.times.items()
        }


@pytest.mark.long
def test_hair_that_follows_simulated_guides(monkeypatch):
    """100,000 strands between 1,000 guides follow a bending head: the time of a window's frame and its parts is
    printed.
    """
    hair_addon.register()
    gpu.init()
    try:
        _play(monkeypatch)
    finally:
        live_hair.cancel_writing()
        invalidation.clear()
        hair_addon.unregister()


def _play(monkeypatch):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(HEAD))
    head = bpy.context.selected_objects[0]
    bpy.context.view_layer.objects.active = head
    bend = head.modifiers.new("Bend", "SIMPLE_DEFORM")
    bend.deform_method, bend.deform_axis = "BEND", "Y"
    for frame, angle in ((1, 0.0), (7, 0.3), (13, -0.3), (19, 0.3)):
        bend.angle = angle
        bend.keyframe_insert("angle", frame=frame)
    monkeypatch.setattr(running, "has_window", lambda: True)
    monkeypatch.setattr(preferences, "device", lambda: DEVICE)
    bpy.ops.vellus.add_hair(guide_count=1000, length=LENGTH, strand_count=100_000)
    guides, hair = (bpy.data.hair_curves[name] for name in ("Hair Guides", "Hair"))
    guides.vellus.simulates = True
    view, parts = View(), Parts(monkeypatch)
    for frame in range(1, 5):  # compiles
        bpy.context.scene.frame_set(frame)
        view.redraw()
    assert guides.vellus.dynamics_status == ""
    parts.watch("simulating", guide_simulation.GuideSimulation, "advance")
    parts.watch("reading the surface", guide_simulation, "read")
    for frame in range(5, 17):
        with parts.of("a frame"):
            with parts.of("Blender's frame, simulating and following"):
                bpy.context.scene.frame_set(frame)
                _ = bindings.of(hair).points  # strands that grow in other threads
            with parts.of("upload"):
                on_gpu(hair)
            with parts.of("drawing"):
                view.redraw()
    times = parts.medians()
    report("Dynamics, hair that follows", 100_000, times, {}, "a frame")
    print(f"{1.0 / times['a frame'].clock:.1f} frames a second; stretch {_stretch(guides):.1e}")
    assert len(parts.times["simulating"]) == 12


def _stretch(guides):
    """Return the largest stretch of all simulated segments."""
    return abs(simulated_hair.played_cache.get(guides.session_uid).simulated.simulation.stretch()).max()
