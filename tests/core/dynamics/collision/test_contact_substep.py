# SPDX-License-Identifier: GPL-3.0-or-later
"""The fused substep of strands that touch a moving mesh equals its stages, on any number of threads."""

import os

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from hair_addon.core.dynamics.collision.contact_substep import CollidingStrands
from hair_addon.core.dynamics.rod import rotations
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.root_motion import RigidMotion, RootPose
from hair_addon.core.dynamics.simulation import Obstacle, Simulation, World
from hair_addon.core.kernels import replays
from tests.support.devices import DEVICE
from tests.support.dynamics.contacts import bumpy

COUNT, FRAME = 300, 1.0 / 24.0  # more than one share of two threads; [s]


def shaken(frames=4, turning=3, durations=(FRAME,), **changes):
    """Return the state of strands on a bumpy ball after some frames, and how many points touch; the ball turns in
    the first.

    durations: of frames by turns [s]; changes: of settings. From the fifth frame on the ball is less smooth.
    """
    rng = np.random.default_rng(0)
    mesh = bumpy(rng)
    faces = rng.integers(len(mesh.triangles), size=COUNT)
    corners = mesh.corners[faces].astype(np.float64)
    out = rotations.unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    guides = corners.mean(axis=1)[:, None] + 0.08 * np.linspace(0.0, 1.0, 12)[:, None] * out[:, None]
    pose = RootPose(guides[:, 0], np.tile(rotations.IDENTITY, (COUNT, 1)))
    values = {"hair_friction": 0.0, "hair_pressure": 0.0, "automatic_substeps": False, "substeps": 4}
    settings = DynamicsSettings(vertex_count=12, bend_stiffness=0.1, sag_free=False, **(values | changes))

    def world(motion, friction=0.3):
        ball = Obstacle("Ball", mesh.vertices.astype(np.float64), mesh.triangles, friction)
        return World(obstacles=(ball.moved(motion),))

    def turned(frame):
        turn = Rotation.from_rotvec([0.0, 0.3 * np.sin(frame), 0.4 * frame]).as_quat()
        return RigidMotion(turn, np.zeros(3), np.array([0.02 * np.sin(frame), 0.0, 0.0]))

    simulation = Simulation(guides, settings, pose, world(turned(0)), DEVICE)
    for frame in range(1, frames + 1):
        motion = turned(min(frame, turning))
        world_now = world(motion, 0.3 if frame < 5 else 1.0)
        simulation.advance(pose.moved(motion), world_now, durations[frame % len(durations)])
    touching = np.count_nonzero(simulation._rods.read("slips") >= 0.0)
    return simulation.save(), touching


def assert_equal(state, other):
    assert state.keys() == other.keys()
    for name in state:
        np.testing.assert_array_equal(state[name], other[name], err_msg=name)


@pytest.mark.skipif(not wp.get_device(DEVICE).is_cpu, reason="a GPU takes one stage after the other")
def test_a_group_at_once_moves_as_stage_by_stage(monkeypatch):
    state, touching = shaken()
    assert touching > 20
    monkeypatch.setattr(CollidingStrands, "takes_groups", False)
    assert_equal(state, shaken()[0])


class Recorder:
    """Commands that Warp records instead of launches, and refits of meshes, as in a CUDA graph."""

    def __init__(self, monkeypatch):
        self._commands, self.replay_count = None, 0
        self._launch, self._refit = wp.launch, wp.Mesh.refit
        monkeypatch.setattr(wp, "launch", self.launch)
        monkeypatch.setattr(wp.Mesh, "refit", lambda mesh: self.refit(mesh))
        monkeypatch.setattr(wp, "capture_launch", self.replay)
        monkeypatch.setattr(replays.Replays, "_recorded", lambda _replays, launch: self.recorded(launch))

    def launch(self, kernel, dim, inputs=(), outputs=(), device=None, block_dim=256):
        details = {"inputs": inputs, "outputs": outputs, "device": device, "block_dim": block_dim}
        command = self._launch(kernel, dim, record_cmd=self._commands is not None, **details)
        if self._commands is not None:
            self._commands.append(command.launch)

    def refit(self, mesh):
        if self._commands is None:
            self._refit(mesh)
        else:
            self._commands.append(lambda: self._refit(mesh))

    def recorded(self, launch):
        self._commands = commands = []
        launch()
        self._commands = None
        return commands

    def replay(self, commands):
        self.replay_count += 1
        for command in commands:
            command()


CHANGES = {
    "alone": {},
    "among hair": {"hair_friction": 2.0, "hair_pressure": 0.5},
    "automatic": {"automatic_substeps": True, "substeps": 2},
    "longer and shorter frames": {"durations": (FRAME, 0.4 * FRAME)},
}


@pytest.mark.parametrize("changes", CHANGES.values(), ids=CHANGES.keys())
def test_what_is_recorded_moves_strands_in_all_later_frames(monkeypatch, changes):
    """Recorded commands move strands correctly in all later frames, on the processor as on a GPU."""
    state, _ = shaken(10, 6, **changes)
    if wp.get_device(DEVICE).is_cpu:
        monkeypatch.setattr(os, "process_cpu_count", lambda: 1)
        monkeypatch.setattr(CollidingStrands, "takes_groups", False)
        recorder = Recorder(monkeypatch)
        monkeypatch.setattr(replays.Replays, "is_recording", True)
        assert_equal(state, shaken(10, 6, **changes)[0])
        assert recorder.replay_count > 0
    else:
        monkeypatch.setattr(replays.Replays, "is_recording", False)
        assert_equal(state, shaken(10, 6, **changes)[0])


@pytest.mark.parametrize("core_count", [1, 5])
def test_on_other_numbers_of_threads(monkeypatch, core_count):
    state, _ = shaken()
    monkeypatch.setattr(os, "process_cpu_count", lambda: core_count)
    assert_equal(state, shaken()[0])
