# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid motions of roots are found, divided and undone."""

import numpy as np
import pytest

from hair_addon.core.dynamics import root_motion
from hair_addon.core.dynamics.rod import rotations
from hair_addon.core.dynamics.root_motion import RigidMotion, RootPose
from hair_addon.core.errors import HairError
from tests.support.dynamics.rods import Simulation, line


def random_pose(rng, count=20):
    return RootPose(rng.normal(size=(count, 3)), rotations.unit(rng.normal(size=(count, 4))), 1.7)


def random_motion(rng):
    return RigidMotion(rotations.unit(rng.normal(size=4)), rng.normal(size=3), rng.normal(size=3))


@pytest.mark.parametrize("count", [1, 2, 20])
def test_a_rigid_motion_is_found(rng, count):
    before, motion = random_pose(rng, count), random_motion(rng)
    found = root_motion.rigid_motion(before, before.moved(motion))
    np.testing.assert_allclose(found.moved(before.positions), motion.moved(before.positions), atol=1e-12)
    assert abs(found.rotation @ motion.rotation) == pytest.approx(1.0, abs=1e-12)


def test_parts_of_a_motion_add_up(rng):
    """A half of a motion, followed by a half about the resulting place, is the whole motion."""
    motion, points = random_motion(rng), rng.normal(size=(9, 3))
    half = motion.part(0.5)
    second = RigidMotion(half.rotation, half.moved(half.center), half.way)
    np.testing.assert_allclose(second.moved(half.moved(points)), motion.moved(points), atol=1e-12)
    np.testing.assert_allclose(motion.part(0.0).moved(points), points, atol=1e-15)
    np.testing.assert_allclose(motion.part(1.0).moved(points), motion.moved(points), atol=1e-12)


def test_strands_are_carried_rigidly(rng):
    pose, points = random_pose(rng, 7), rng.normal(size=(7, 5, 3))
    carried = pose.carried(points)
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2)
    np.testing.assert_allclose(np.linalg.norm(np.diff(carried, axis=1), axis=2), 1.7 * lengths, rtol=1e-12)
    apart = [np.linalg.norm(strands - strands[:, :1], axis=2) for strands in (points, carried)]
    np.testing.assert_allclose(apart[1], 1.7 * apart[0], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(pose.carried(np.zeros((7, 1, 3)))[:, 0], pose.positions, atol=1e-15)


def test_far_roots_and_turned_ones_jump():
    turned = np.array([[0.0, 0.0, np.sin(a / 2), np.cos(a / 2)] for a in np.radians([0.0, 119.0, 121.0, 0.0])])
    before = RootPose(np.zeros((4, 3)), np.tile(rotations.IDENTITY, (4, 1)))
    after = RootPose(np.array([[0.99, 0, 0], [0, 0, 0], [0, 0, 0], [0, 1.01, 0.0]]), -turned)
    assert root_motion.jumps(before, after, 1.0).tolist() == [False, False, True, True]


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan])
def test_a_surface_without_size_is_refused(scale):
    with pytest.raises(HairError, match="no size"):
        RootPose(np.zeros((1, 3)), rotations.IDENTITY[None], scale)


@pytest.mark.parametrize("name", ["positions", "turns"])
def test_coordinates_that_are_no_numbers_are_refused(name):
    values = {"positions": np.zeros((2, 3)), "turns": np.tile(rotations.IDENTITY, (2, 1))}
    values[name][1, 0] = np.nan
    with pytest.raises(HairError, match="non-finite"):
        RootPose(**values)


@pytest.mark.parametrize("has_start", [False, True])
def test_kernels_turn_roots_as_numpy_does(rng, has_start):
    """Kernels turn roots with NumPy's bits, from the groom or another rotation, and frames continue each other."""
    simulation = Simulation(line(0.1, 4) + rng.normal(size=(35, 1, 3)))
    rods, (start, turns) = simulation.rods, rotations.unit(rng.normal(size=(2, 35, 4)))
    if has_start:
        rods.set_start(start)
    positions = rng.normal(size=(35, 3))
    rods.reset(positions, turns)
    expected = rods.read("roots")
    rods.reset()
    before = rods.read("roots")
    rods.move_roots(positions, turns)
    np.testing.assert_array_equal(rods.read("roots")[:, 7:], expected[:, 7:])
    np.testing.assert_array_equal(rods.read("roots")[:, :7], before[:, 7:])
    if has_start:
        rods.move_roots(positions, start)
        np.testing.assert_allclose(rods.read("roots")[:, 10:], before[:, 10:], atol=1e-6)
