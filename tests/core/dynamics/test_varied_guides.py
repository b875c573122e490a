# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that differ between guides: each guide moves as in hair whose guides all have its settings."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.dynamics.rod import rotations
from hair_addon.core.dynamics.rod.settings import VARIED, DynamicsSettings
from hair_addon.core.dynamics.root_motion import RigidMotion, RootPose
from hair_addon.core.dynamics.simulation import Obstacle, Simulation, World
from hair_addon.core.errors import HairError
from tests.support.devices import DEVICE
from tests.support.meshes import subdivided_sphere
from tests.support.pairs import share_of

COUNT, RADIUS, FRAME = 21, 0.1, 1.0 / 24.0  # more guides than lanes of a group
SETTINGS = DynamicsSettings(vertex_count=11, hair_friction=0.0, hair_pressure=0.0, bend_stiffness=3.0, substeps=4)

# {setting: (value of even guides, value of odd guides)}
VALUES = {"bend_stiffness": (0.5, 80.0), "damping": (0.0, 0.3), "hold": (0.0, 400.0), "pinned": (0.0, 0.45)}


def moved(settings, varied, has_ball=False):
    """Return (G, P, 3) [m] of guides on a turning ball after eight frames; has_ball: whether they hit another ball."""
    angles = np.linspace(0.0, 2.0, COUNT)
    ways = np.stack([np.cos(angles), np.sin(angles), 0.4 * np.sin(3.0 * angles)], axis=1)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    groom = ways[:, None] * np.linspace(RADIUS, RADIUS + 0.15, 21)[None, :, None]
    pose = RootPose(groom[:, 0], np.tile(rotations.IDENTITY, (COUNT, 1)))
    mesh = subdivided_sphere(2, 0.085)
    ball = Obstacle("Ball", np.add(mesh.vertices, [0.05, 0.17, -0.13]), mesh.triangles)
    world = World(obstacles=(ball,) if has_ball else ())
    simulation = Simulation(groom, settings, pose, world, DEVICE, varied=varied)
    for frame in range(1, 9):
        half = 0.5 * np.sin(0.4 * frame)
        turn = RigidMotion(np.array([np.sin(half), 0.0, 0.0, np.cos(half)]), np.zeros(3), np.zeros(3))
        simulation.advance(pose.moved(turn), world, FRAME)
    return simulation.points()


def test_all_settings_that_may_vary_are_tested():
    """Every setting that a map may vary has values here."""
    assert VALUES.keys() == VARIED.keys()


@pytest.mark.parametrize("has_ball", [False, True])
@pytest.mark.parametrize("name", share_of(VALUES, 2))
def test_each_guide_moves_with_its_own_setting(name, has_ball):
    """Guides with alternating values have the bits of guides that all have the value; pinned guides up to rounding."""
    is_odd = np.arange(COUNT) % 2 == 1
    found = moved(SETTINGS, {name: np.where(is_odd, VALUES[name][1], VALUES[name][0])}, has_ball)
    alone = [moved(replace(SETTINGS, **{name: value}), {}, has_ball) for value in VALUES[name]]
    tolerance = 1e-6 if name == "pinned" else 0.0  # [m]
    np.testing.assert_allclose(found[~is_odd], alone[0][~is_odd], rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(found[is_odd], alone[1][is_odd], rtol=0.0, atol=tolerance)
    assert np.abs(alone[0] - alone[1]).max(axis=(1, 2)).min() > 1e-4


def test_the_other_ball_is_hit():
    """The other ball changes the motion of guides, so that tests with the ball contain contacts."""
    apart = np.abs(moved(SETTINGS, {}, True) - moved(SETTINGS, {})).max(axis=(1, 2))
    assert (apart > 1e-3).sum() >= 2


@pytest.mark.parametrize("name", VALUES)
def test_equal_values_are_the_setting(name):
    """Guides that all have the value of a setting have the bits of guides without values of their own."""
    settings = replace(SETTINGS, **{name: VALUES[name][1]})
    np.testing.assert_array_equal(moved(settings, {name: np.full(COUNT, VALUES[name][1])}), moved(settings, {}))


@pytest.mark.parametrize("name", VALUES)
@pytest.mark.parametrize("wrong", [-1.0, np.nan, np.inf])
def test_values_outside_of_their_range_are_an_error(name, wrong):
    """A value that is negative or not finite, or a missing value, does not reach the solver."""
    values = np.full(COUNT, VALUES[name][1])
    with pytest.raises(HairError, match="values of"):
        moved(SETTINGS, {name: values[1:]})
    values[3] = wrong
    with pytest.raises(HairError, match=name):
        moved(SETTINGS, {name: values})
