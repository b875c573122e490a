# SPDX-License-Identifier: GPL-3.0-or-later
"""Laws of Braid: tresses, their distances, and the course of their centre lines."""

import numpy as np
import pytest

from hair_addon.core.styling import braid
from tests.support.stepped import stepped

RADIUS, PITCH = 0.006, 0.036
EVEN = {"radius": RADIUS, "pitch": PITCH, "thickness": 0.0, "root": 1.0, "tip": 1.0, "start": 0.0, "flatness": 0.0}


def lock(count=90, length=0.3, point_count=121):
    """(S, P, 3): straight strands rooted in a disc, and the strand in the middle."""
    rank = np.arange(count)
    radius, angle = 0.01 * np.sqrt((rank + 0.5) / count), 2.399963 * rank
    strands = np.zeros((count, point_count, 3), np.float32)
    strands[:, :, 0], strands[:, :, 1] = (radius * np.cos(angle))[:, None], (radius * np.sin(angle))[:, None]
    strands[:, :, 2] = np.linspace(0.0, length, point_count)
    centre = np.zeros((1, point_count, 3), np.float32)
    centre[:, :, 2] = strands[:1, :, 2]
    return strands, centre


def tresses_of(points, count):
    """(S,): the tress of each strand, by the sector of the lock that it is rooted in."""
    angle = np.arctan2(points[:, 0, 1], points[:, 0, 0])
    first = np.pi / 2.0 if count == 3 else 0.0
    return np.round((angle - first) / (2.0 * np.pi / count)).astype(int) % count


def distances_between(points, line):
    """(…,) [m] from points (…, 3) to a curve through points (P, 3)."""
    places = np.arange(len(line))
    fine = np.linspace(0.0, len(line) - 1.0, 12 * len(line))
    dense = np.stack([np.interp(fine, places, line[:, k]) for k in range(3)], axis=1)
    return np.linalg.norm(points[..., None, :] - dense, axis=-1).min(axis=-1)


@pytest.mark.parametrize("pattern, count", [("BRAID", 3), ("ROPE", 2)])
def test_strands_gather_in_tresses(pattern, count):
    """As many as the pattern has, of about as many strands each, and thin far from the roots."""
    strands, centre = lock()
    made = stepped(strands, braid.Settings(pattern=pattern, **EVEN), centres=centre)
    label = tresses_of(made, count)
    sizes = np.bincount(label, minlength=count)
    assert sizes.min() > 0.7 * len(strands) / count
    for tress in range(count):
        strands_of = made[label == tress].astype(np.float64)
        # All but the ends, which are not at the same places.
        assert distances_between(strands_of[1:, 60:-10], strands_of[0, 50:]).max() < 0.1 * RADIUS


def test_centre_lines_of_tresses_stay_apart():
    """By 0.9 R in a round braid whose pitch is 6 R."""
    strands, centre = lock()
    made = stepped(strands, braid.Settings(pattern="BRAID", **EVEN), centres=centre).astype(np.float64)
    label = tresses_of(made, 3)
    lines = [made[label == tress].mean(axis=0)[50:] for tress in range(3)]
    for first, second in ((0, 1), (1, 2), (2, 0)):
        apart = np.linalg.norm(lines[first][:, None] - lines[second], axis=2).min(axis=1)[5:-5]
        assert apart.min() > 0.75 * RADIUS


def test_each_tress_goes_over_the_next_in_turn():
    """All three wind through the same places, a third of the pitch after each other."""
    strands, centre = lock()
    made = stepped(strands, braid.Settings(pattern="BRAID", **EVEN), centres=centre).astype(np.float64)
    label = tresses_of(made, 3)
    widths = [np.ptp(made[label == tress].mean(axis=0)[50:, :2], axis=0) for tress in range(3)]
    np.testing.assert_allclose(widths, np.tile(np.mean(widths, axis=0), (3, 1)), rtol=0.15)


def test_two_tresses_wind_about_each_other():
    strands, centre = lock()
    made = stepped(strands, braid.Settings(pattern="ROPE", **EVEN), centres=centre).astype(np.float64)
    label = tresses_of(made, 2)
    lines = [made[label == tress].mean(axis=0)[50:, :2] for tress in range(2)]
    middle = 0.5 * (lines[0] + lines[1])
    apart = np.linalg.norm(lines[0] - lines[1], axis=1)
    np.testing.assert_allclose(apart, 2.0 * RADIUS, rtol=0.1)
    assert np.ptp(middle, axis=0).max() < 0.5 * RADIUS
    angle = np.unwrap(np.arctan2(*(lines[0] - lines[1]).T))
    assert abs(angle[-1] - angle[0]) > 2.0 * np.pi


def test_a_flat_braid_is_flat():
    strands, centre = lock()
    made = stepped(strands, braid.Settings(pattern="BRAID", **(EVEN | {"flatness": 1.0})), centres=centre)
    away = made[:, 50:].astype(np.float64).reshape(-1, 3)[:, :2]
    sizes = np.linalg.svd(away - away.mean(axis=0), compute_uv=False)
    assert sizes[1] < 0.25 * sizes[0]


def test_without_a_radius_a_braid_is_a_clump():
    strands, centre = lock()
    made = stepped(strands, braid.Settings(**(EVEN | {"radius": 0.0})), centres=centre)
    assert np.linalg.norm(made[:, 40:, :2], axis=2).max() < 1e-5
