# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides that are held up to a tie: the part before it follows the surface rigidly, the rest swings."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.dynamics.rod import rotations
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.root_motion import RigidMotion, RootPose
from hair_addon.core.dynamics.simulation import Obstacle, Simulation, World
from hair_addon.core.errors import HairError
from tests.support.meshes import subdivided_sphere

DEVICE = "cpu"
RADIUS, FRAME = 0.1, 1.0 / 24.0
HELD = 0.45
SETTINGS = DynamicsSettings(vertex_count=12, hair_friction=0.0, hair_pressure=0.0, bend_stiffness=20.0)


def tails(count=24, point_count=31):
    """Return (count, point_count, 3) [m]: hair that lies on a ball up to its back, and hangs from there."""
    along = np.linspace(0.0, 1.0, point_count)
    starts = np.linspace(-0.3, 0.3, count)
    over = np.minimum(along / HELD, 1.0) * 0.5 * np.pi
    x = np.outer(starts, 1.0 - np.minimum(along / HELD, 1.0)) * RADIUS
    size = np.sqrt((1.003 * RADIUS) ** 2 - x**2)
    rest = np.maximum(along - HELD, 0.0) / HELD * 0.5 * np.pi * RADIUS
    return np.stack([x, size * np.sin(over), size * np.cos(over) - rest], axis=2)


def turned(frame):
    """Return the motion of a head: a quick turn of half a radian within six frames, then rest."""
    angle = 0.5 * min(frame / 6.0, 1.0)
    return RigidMotion(np.array([0.0, 0.0, np.sin(angle / 2.0), np.cos(angle / 2.0)]), np.zeros(3), np.zeros(3))


def started(groom, settings=SETTINGS, held=HELD, has_ball=False):
    pose = RootPose(groom[:, 0], np.tile(rotations.IDENTITY, (len(groom), 1)))
    simulation = Simulation(groom, settings, pose, world(0, has_ball), DEVICE, held=np.full(len(groom), held))
    return simulation, pose


def world(frame, has_ball):
    mesh = subdivided_sphere(2, RADIUS)
    ball = Obstacle("Ball", mesh.vertices.astype(np.float64), mesh.triangles)
    return World(obstacles=(ball.moved(turned(frame)),) if has_ball else ())


def play(simulation, pose, frames, has_ball=False):
    for frame in frames:
        simulation.advance(pose.moved(turned(frame)), world(frame, has_ball), FRAME)
    return simulation.points()


@pytest.mark.parametrize("has_ball", [False, True])
def test_hair_is_rigid_up_to_its_tie_and_swings_behind_it(has_ball):
    groom = tails()
    is_before = np.linspace(0.0, 1.0, groom.shape[1]) <= HELD
    simulation, pose = started(groom, has_ball=has_ball)
    after = play(simulation, pose, range(1, 7), has_ball)
    rigid = turned(6).moved(groom)
    assert np.linalg.norm(after - rigid, axis=2)[:, is_before].max() < 1e-5
    assert np.linalg.norm(after - rigid, axis=2)[:, -1].min() > 0.005
    rested = play(simulation, pose, range(7, 80), has_ball)
    assert np.linalg.norm(rested - rigid, axis=2)[:, is_before].max() < 1e-5
    if not has_ball:
        assert np.linalg.norm(rested - rigid, axis=2).max() < 0.002


def test_the_setting_releases_hair_and_holds_it_again():
    groom = tails(8)
    is_before = np.linspace(0.0, 1.0, groom.shape[1]) <= HELD
    simulation, pose = started(groom, replace(SETTINGS, holds_ties=False))
    free = play(simulation, pose, range(1, 7))
    assert np.linalg.norm(free - turned(6).moved(groom), axis=2)[:, is_before].max() > 1e-3
    simulation.change(SETTINGS)
    held = play(simulation, pose, range(7, 9))
    assert np.linalg.norm(held - turned(6).moved(groom), axis=2)[:, is_before].max() < 1e-5


def test_guides_that_are_not_held_have_the_same_bits_beside_held_ones():
    groom = tails(8)
    pose = RootPose(groom[:, 0], np.tile(rotations.IDENTITY, (8, 1)))
    some = np.where(np.arange(8) % 2, HELD, 0.0)
    simulations = [Simulation(groom, SETTINGS, pose, World(), DEVICE, held=held) for held in (None, some)]
    free, mixed = (play(simulation, pose, range(1, 5)) for simulation in simulations)
    assert np.array_equal(mixed[::2], free[::2]) and not np.array_equal(mixed[1::2], free[1::2])


def test_fractions_beyond_a_guide_are_refused():
    with pytest.raises(HairError, match="from 0 to 1"):
        started(tails(3), held=1.5)
