# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands keep their shape relative to a moving course."""

import numpy as np
import pytest

from hair_addon.core.geometry import strands
from hair_addon.core.interpolation import carried_strands

COUNT, POINTS = 12, 20
UP = np.array([0.0, 0.0, 1.0])


def rotation(axis, angle):
    """Return the rotation (3, 3) by an angle about an axis."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew


def courses_from(rng, elevation):
    """Return (COUNT, POINTS, 3) smooth courses in the plane y = 0 that bend, from an elevation above the ground on."""
    bends = rng.uniform(-0.3, 0.3, COUNT)
    angles = elevation + bends[:, None] * np.linspace(0.0, 1.0, POINTS - 1)
    steps = np.stack([np.cos(angles), np.zeros_like(angles), np.sin(angles)], axis=2) / POINTS
    return np.concatenate([np.zeros((COUNT, 1, 3)), np.cumsum(steps, axis=1)], axis=1)


@pytest.fixture
def beside(rng):
    """Return a function of courses: (points, starts, places) of strands of 3 to 30 points near them."""

    def near(courses):
        counts = rng.integers(3, 31, COUNT)
        starts = strands.curve_offsets(counts)
        places = np.concatenate([np.linspace(0.0, 1.0, count) for count in counts])
        at = places * (POINTS - 1)
        low = np.minimum(at.astype(int), POINTS - 2)
        share = (at - low)[:, None]
        own = np.repeat(np.arange(COUNT), counts)
        on = (1.0 - share) * courses[own, low] + share * courses[own, low + 1]
        offsets = rng.normal(scale=0.05, size=on.shape) * places[:, None]  # none at the roots
        return (on + offsets).astype(np.float32), starts, places.astype(np.float32)

    return near


def carry(strands_there, before, now, normal=UP, **options):
    courses = (np.asarray(courses, np.float32) for courses in (before, now))
    normals = np.tile(normal, (COUNT, 1)).astype(np.float32)
    return carried_strands.carried(*strands_there, *courses, normals, **options)


def crooked(rng):
    return np.cumsum(rng.normal(size=(COUNT, POINTS, 3)), axis=1) / POINTS


def test_no_bit_changes_while_courses_rest(rng, beside):
    courses = crooked(rng)
    given = beside(courses)
    assert np.array_equal(carry(given, courses, courses), given[0])


@pytest.mark.parametrize(
    ("elevation", "axis", "angle"),
    [(0.05, UP, 2.0), (0.3, UP, 1.2), (1.4, (0, 1, 0), 0.9), (0.1, (0, 1, 0), -1.0), (0.6, (0, 1, 0), -0.6)],
    ids=["turned about the normal", "turned while rising", "swung over", "raised", "raised further"],
)
def test_strands_turn_rigidly_with_courses_that_do(rng, beside, elevation, axis, angle):
    courses, turn = courses_from(rng, elevation), rotation(axis, angle)
    given = beside(courses)
    np.testing.assert_allclose(carry(given, courses, courses @ turn.T), given[0] @ turn.T, atol=1e-3)


def test_what_turns_all_with_the_surface_turns_the_strands(rng, beside):
    before, now, turn = crooked(rng), crooked(rng), rotation((1.0, -2.0, 0.5), 2.1)
    given = beside(before)
    expected = carry(given, before, now) @ turn.T
    turned = (given[0] @ turn.T).astype(np.float32), *given[1:]
    np.testing.assert_allclose(carry(turned, before @ turn.T, now @ turn.T, turn @ UP), expected, atol=2e-5)


def test_offsets_from_the_root_keep_their_lengths(rng, beside):
    """Two strands with the same places are turned alike, so the distance between their points stays."""
    before, now = courses_from(rng, 0.5), crooked(rng)
    points, starts, places = beside(before)
    others = (points + rng.normal(scale=0.1, size=points.shape)).astype(np.float32)
    aside = np.repeat((others - points)[starts[:-1]], np.diff(starts), axis=0)
    apart = carry((others, starts, places), before, now) - carry((points, starts, places), before, now)
    expected = np.linalg.norm(others - points - aside, axis=1)
    np.testing.assert_allclose(np.linalg.norm(apart - aside, axis=1), expected, atol=1e-5)


def test_roots_keep_their_offsets_from_their_courses(rng, beside):
    before, now = courses_from(rng, 0.5), courses_from(rng, 1.3)
    points, starts, places = beside(before)
    shifts = rng.normal(scale=0.1, size=(COUNT, 3))
    given = (points + np.repeat(shifts, np.diff(starts), axis=0)).astype(np.float32), starts, places
    np.testing.assert_allclose(carry(given, before, now)[starts[:-1]], shifts, atol=1e-6)


def test_the_way_back_is_the_inverse(rng, beside):
    before, now = courses_from(rng, 0.3), crooked(rng)
    points, *places = beside(before)
    there = carry((points, *places), before, now)
    assert np.abs(there - points).max() > 0.1
    np.testing.assert_allclose(carry((there, *places), before, now, is_back=True), points, atol=5e-6)
