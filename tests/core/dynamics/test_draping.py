# SPDX-License-Identifier: GPL-3.0-or-later
"""Draped guides are outside the surface, lower than before, as long as before, and at rest."""

from dataclasses import replace

import numpy as np
import pytest

from hair_addon.core.dynamics.draping import draped
from hair_addon.core.dynamics.rod.settings import DynamicsSettings
from tests.support.devices import DEVICE
from tests.support.meshes import subdivided_sphere

RADIUS, LENGTH = 0.1, 0.25
GRAVITY = (0.0, 0.0, -9.81)
BALL = subdivided_sphere(4, RADIUS)


@pytest.fixture(scope="module")
def grown():
    """Return (40, 41, 3): straight guides that stand on the upper half of a ball."""
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(40, 3))
    normals[:, 2] = abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals[:, None] * (RADIUS + LENGTH * np.linspace(0.0, 1.0, 41))[:, None]


@pytest.fixture(scope="module")
def fallen(grown):
    return draped(grown, BALL, DynamicsSettings(bend_stiffness=1.0), GRAVITY, 4.0, DEVICE)


def test_guides_hang_outside_the_surface(grown, fallen):
    assert fallen[..., 2].mean() < grown[..., 2].mean() - 0.5 * LENGTH
    assert fallen[:, -1, 2].max() < 0.0
    flat = np.linalg.norm(BALL.corners.mean(axis=1), axis=1).min()
    assert np.linalg.norm(fallen, axis=2).min() > flat - 1e-4  # the curve between vertices, and a ball of triangles


def test_roots_and_lengths_are_kept(grown, fallen):
    np.testing.assert_allclose(fallen[:, 0], grown[:, 0], atol=1e-7)
    lengths = np.linalg.norm(np.diff(fallen, axis=1), axis=2).sum(axis=1)
    np.testing.assert_allclose(lengths, LENGTH, rtol=0.01)


def test_what_is_draped_stays(fallen):
    """Draping guides again hardly moves them, although their shape without forces is another one."""
    hold = replace(DynamicsSettings(bend_stiffness=1.0), gravity=0.0)
    again = draped(fallen, BALL, hold, GRAVITY, 1.0, DEVICE)
    assert np.linalg.norm(again - fallen, axis=2).max() < 0.002


def test_stiffer_guides_fall_less(grown, fallen):
    stiff = draped(grown, BALL, DynamicsSettings(bend_stiffness=1000.0), GRAVITY, 2.0, DEVICE)
    assert stiff[..., 2].mean() > fallen[..., 2].mean() + 0.05
