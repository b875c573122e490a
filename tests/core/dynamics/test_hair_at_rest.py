# SPDX-License-Identifier: GPL-3.0-or-later
"""Limp hair that has fallen comes to rest, as pressure and cohesion between strands add no energy."""

import numpy as np
import pytest

from hair_addon.core.dynamics.rod import rotations
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from hair_addon.core.dynamics.root_motion import RootPose
from hair_addon.core.dynamics.simulation import Simulation, World

LENGTH, SPACING, ALONG = 0.15, 0.012, 7  # [m], [m], guides along a side of the square they grow on
RATE = 24  # frames a second
FALL, SETTLING = 1, 3  # [s]


def fallen(rng, device, **settings):
    """Return mean squared speeds (S,) [m²/s²] of points in the frames of level hair that falls and settles."""
    places = SPACING * np.stack(np.meshgrid(*2 * [np.arange(ALONG)], indexing="ij"), axis=-1).reshape(-1, 2)
    roots = np.pad(places, ((0, 0), (0, 1)))
    directions = np.array([1.0, 0.0, -0.2]) + 0.1 * rng.normal(size=(len(roots), 1, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    groom = roots[:, None] + np.linspace(0.0, LENGTH, 17)[:, None] * directions
    pose = RootPose(roots, np.tile(rotations.IDENTITY, (len(roots), 1)), 1.0)
    limp = DynamicsSettings(bend_stiffness=1.0, sag_free=False, vertex_count=12, **settings)
    simulation, shown = Simulation(groom, limp, pose, World(), device), []
    for _ in range(RATE * (FALL + SETTLING)):
        simulation.advance(pose, World(), 1.0 / RATE)
        shown.append(simulation.vertices())
    return ((RATE * np.diff(shown, axis=0)) ** 2).sum(axis=3).mean(axis=(1, 2))


@pytest.mark.parametrize(("wetness", "pressure"), [(1.0, 0.5), (1.0, 5.0), (0.0, 5.0)])
def test_fallen_hair_comes_to_rest(rng, device, wetness, pressure):
    energy = fallen(rng, device, wetness=wetness, hair_pressure=pressure)
    assert energy[-RATE:].mean() < 2e-4 * energy.max()
