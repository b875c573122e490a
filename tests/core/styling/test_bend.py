# SPDX-License-Identifier: GPL-3.0-or-later
"""Bend turns strands by its angles and directions, also after other bends."""

import numpy as np
import pytest

from hair_addon.core.styling import bend
from tests.support.dynamics.stepped import UP, stepped, straight_strands

ALL = {"root": 1.0, "tip": 1.0}


def directions(points):
    segments = np.diff(points.astype(np.float64), axis=1)
    return segments / np.linalg.norm(segments, axis=-1, keepdims=True)


def flat_strands(count=12):
    """Return straight strands on a plane, each in another direction from one root."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    ahead = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    return (np.linspace(0.0, 0.2, 41)[None, :, None] * ahead[:, None]).astype(np.float32)


@pytest.mark.parametrize("angle", [0.3, 1.0, -0.7])
def test_strands_bend_away_from_the_surface_by_the_angle(angle):
    made = stepped(flat_strands(), bend.Settings(angle=angle, **ALL))
    np.testing.assert_allclose(directions(made)[:, :, 2], np.sin(angle), atol=1e-5)


def test_the_angle_grows_along_the_strand_as_its_profile():
    made = stepped(flat_strands(), bend.Settings(angle=1.2))
    x = np.linspace(0.0, 1.0, 41)[1:]
    np.testing.assert_allclose(np.arcsin(directions(made)[:, :, 2]), np.tile(1.2 * x, (12, 1)), atol=1e-4)


def test_bends_about_one_axis_add():
    strands = flat_strands()
    once = stepped(strands, bend.Settings(angle=0.9, **ALL))
    twice = stepped(strands, bend.Settings(angle=0.5, **ALL), bend.Settings(angle=0.4, **ALL))
    np.testing.assert_allclose(twice, once, atol=1e-6)
    back = stepped(strands, bend.Settings(angle=0.5, **ALL), bend.Settings(angle=-0.5, **ALL))
    np.testing.assert_allclose(back, strands, atol=1e-6)


def test_opposite_directions_are_opposite_bends():
    strands = flat_strands()
    there = stepped(strands, bend.Settings(angle=0.6, turn=np.pi))
    np.testing.assert_allclose(there, stepped(strands, bend.Settings(angle=-0.6)), atol=1e-6)


def test_a_quarter_turn_bends_sideways():
    made = directions(stepped(flat_strands(), bend.Settings(angle=0.6, turn=np.pi / 2.0, **ALL)))
    old = directions(flat_strands())
    np.testing.assert_allclose(made[:, :, 2], 0.0, atol=1e-5)
    np.testing.assert_allclose((made * old).sum(axis=-1), np.cos(0.6), atol=1e-5)
    # All to the same side.
    side = np.cross(old, made)[:, :, 2]
    np.testing.assert_allclose(side, np.sin(0.6) * np.sign(side[0, 0]), atol=1e-5)


def test_a_strand_along_the_normal_bends_too():
    made = directions(stepped(straight_strands(4), bend.Settings(angle=0.5, **ALL)))
    np.testing.assert_allclose(made @ UP, np.cos(0.5), atol=1e-5)


def test_random_directions_go_all_round():
    made = directions(stepped(straight_strands(500, 0.2, 5, 0.0), bend.Settings(angle=0.5, random_turn=1.0, **ALL)))
    assert np.linalg.norm(made[:, 0, :2].mean(axis=0)) < 0.1 * np.sin(0.5)


def test_a_roll_winds_up():
    """A roll of three turns over the last quarter winds up, so the tip ends near the start of the roll."""
    strands = flat_strands()
    made = stepped(strands, bend.Settings(**bend.ROLL))
    np.testing.assert_allclose(made[:, :31], strands[:, :31], atol=1e-6)
    assert np.linalg.norm(made[:, -1] - made[:, 31], axis=1).max() < 0.5 * 0.05
