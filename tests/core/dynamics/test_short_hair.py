# SPDX-License-Identifier: GPL-3.0-or-later
"""Short stiff hair that lies on its surface, such as brows and lashes, does not break in any orientation."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.dynamics import moving_mesh
from hair_addon.core.dynamics.rod import rotations
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.root_motion import RigidMotion, RootPose
from hair_addon.core.dynamics.simulation import Obstacle, Simulation, World
from hair_addon.core.geometry import strands
from hair_addon.core.geometry.closest_point import SurfaceQuery
from hair_addon.core.geometry.mesh import TriMesh, positions
from tests.support.devices import DEVICE
from tests.support.meshes import subdivided_sphere

RADIUS, LENGTH, FRAME = 0.14, 0.008, 1.0 / 24.0
BALL = subdivided_sphere(4, RADIUS)
FREE = DynamicsSettings(hair_friction=0.0, hair_pressure=0.0)


def brow(rng, count=16):
    """Return (G, 9, 3) guides that leave the front of a ball and lie down along it."""
    t = np.linspace(0.0, 1.0, 9)
    at = np.stack([rng.uniform(-0.5, 0.5, count), -np.ones(count), rng.uniform(0.1, 0.3, count)], axis=1)
    normals = rotations.unit(at)
    across = rotations.unit(np.cross(normals, [0.1, 0.2, -1.0]))
    along = rotations.unit(normals[:, None] + (LENGTH / RADIUS) * t[:, None] * across[:, None])
    return (RADIUS + 0.0004 + 0.0006 * np.sin(2.4 * t))[:, None] * along


def shaken(frame):
    """Return the motion of a head that turns 40° to either side three times a second and nods, faster than real
    heads.
    """
    angle = np.radians(40.0) * np.sin(6.0 * np.pi * frame * FRAME)
    nod = 0.2 * np.sin(4.0 * np.pi * frame * FRAME)
    turn = np.array([0.0, 0.0, np.sin(0.5 * angle), np.cos(0.5 * angle)])
    tilt = np.array([np.sin(0.5 * nod), 0.0, 0.0, np.cos(0.5 * nod)])
    way = np.array([0.03 * np.sin(6.0 * np.pi * frame * FRAME), 0.0, 0.0])
    return RigidMotion(rotations.product(turn, tilt), np.zeros(3), way)


def test_short_stiff_hair_on_a_shaken_head_does_not_break(rng):
    groom = brow(rng)
    pose = RootPose(groom[:, 0], np.tile(rotations.IDENTITY, (len(groom), 1)))
    vertices = BALL.vertices.astype(np.float64)

    def world(posed):
        return World(obstacles=(Obstacle("Ball", posed, BALL.triangles),))

    settings = replace(FREE, bend_stiffness=1000.0)
    simulation = Simulation(groom, settings, pose, world(vertices), DEVICE)
    broken = []
    for frame in range(1, 12):
        motion = shaken(frame)
        simulation.advance(pose.moved(motion), world(motion.moved(vertices)), FRAME)
        broken.append(len(simulation.broken))
    assert broken == [0] * 11
    back = rotations.rotated(rotations.inverse(motion.rotation), simulation.points() - motion.way)
    assert np.linalg.norm(back, axis=2).min() > RADIUS - 1e-4  # a ball of triangles
    assert np.linalg.norm(back - groom, axis=2).max() < 0.2 * LENGTH


@pytest.mark.parametrize("is_turned", [False, True])
def test_hair_stays_in_front_of_an_open_mesh_whichever_way_it_is_wound(rng, is_turned):
    front = BALL.triangles[BALL.corners[..., 1].max(axis=1) < -0.3 * RADIUS]
    mesh = TriMesh(BALL.vertices, front[:, [0, 2, 1]] if is_turned else front)
    groom = brow(rng, 16)
    roots = SurfaceQuery(mesh).nearest(groom[:, 0])
    groom += (positions(mesh, roots) - groom[:, 0])[:, None]
    halves = np.radians(7.5) * np.arange(1, 6)
    turns = [RigidMotion(np.array([0.0, 0.0, np.sin(a), np.cos(a)]), np.zeros(3), np.zeros(3)) for a in halves]
    poses = [motion.moved(mesh.vertices.astype(np.float64)).astype(np.float32) for motion in turns]
    guides = strands.from_numpy(groom.astype(np.float32), roots)
    frames = [*moving_mesh.simulated(mesh, guides, poses, FREE, FRAME, (0.0, 0.0, -9.81), DEVICE)]
    back = rotations.rotated(rotations.inverse(turns[-1].rotation), frames[-1].astype(np.float64))
    assert np.linalg.norm(back - groom, axis=2).max() < 0.1 * LENGTH
