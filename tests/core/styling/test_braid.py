# SPDX-License-Identifier: GPL-3.0-or-later
"""Braid has tresses with their distances, and center lines with their course."""

import numpy as np
import pytest

from hair_addon.core.geometry.strands import segment_lengths
from hair_addon.core.styling import braid, clump, curl
from tests.support.dynamics.stepped import curved_strands, stepped

RADIUS, PITCH = 0.006, 0.036
EVEN = {"radius": RADIUS, "pitch": PITCH, "thickness": 0.0, "root": 1.0, "tip": 1.0, "start": 0.0, "flatness": 0.0}


def lock(count=90, length=0.3, point_count=121, size=0.01):
    """Return (S, P, 3) straight strands rooted in a disc of a radius [m], and the strand in the middle."""
    rank = np.arange(count)
    radius, angle = size * np.sqrt((rank + 0.5) / count), 2.399963 * rank
    strands = np.zeros((count, point_count, 3), np.float32)
    strands[:, :, 0], strands[:, :, 1] = (radius * np.cos(angle))[:, None], (radius * np.sin(angle))[:, None]
    strands[:, :, 2] = np.linspace(0.0, length, point_count)
    centre = np.zeros((1, point_count, 3), np.float32)
    centre[:, :, 2] = strands[:1, :, 2]
    return strands, centre


def tresses_of(points, count):
    """Return (S,): the tress of each strand, by the sector of the lock in which it is rooted."""
    angle = np.arctan2(points[:, 0, 1], points[:, 0, 0])
    first = np.pi / 2.0 if count == 3 else 0.0
    return np.round((angle - first) / (2.0 * np.pi / count)).astype(int) % count


def distances_between(points, line):
    """Return (…,) distances [m] from points (…, 3) to a curve through points (P, 3)."""
    places = np.arange(len(line))
    fine = np.linspace(0.0, len(line) - 1.0, 12 * len(line))
    dense = np.stack([np.interp(fine, places, line[:, k]) for k in range(3)], axis=1)
    return np.linalg.norm(points[..., None, :] - dense, axis=-1).min(axis=-1)


@pytest.mark.parametrize("pattern, count", [("BRAID", 3), ("ROPE", 2)])
def test_strands_gather_in_tresses(pattern, count):
    """The pattern's number of tresses has about equal numbers of strands, and tresses are thin far from the roots."""
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
    """Center lines in a round braid with a pitch of 6 R stay 0.9 R apart."""
    strands, centre = lock()
    made = stepped(strands, braid.Settings(pattern="BRAID", **EVEN), centres=centre).astype(np.float64)
    label = tresses_of(made, 3)
    lines = [made[label == tress].mean(axis=0)[50:] for tress in range(3)]
    for first, second in ((0, 1), (1, 2), (2, 0)):
        apart = np.linalg.norm(lines[first][:, None] - lines[second], axis=2).min(axis=1)[5:-5]
        assert apart.min() > 0.75 * RADIUS


def test_each_tress_goes_over_the_next_in_turn():
    """Each tress goes over the next in turn: all three wind through the same places, a third of the pitch apart."""
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


def swung(strands, angle, is_bent=False):
    """Return (S, P, 3) strands that swing around the Y axis at fixed roots; is_bent: the tips by the angle."""
    segments = np.diff(strands.astype(np.float64), axis=1)
    part = np.linspace(0.0, 1.0, segments.shape[1]) if is_bent else np.ones(segments.shape[1])
    cosine, sine = np.cos(angle * part), np.sin(angle * part)
    x, y, z = np.moveaxis(segments, 2, 0)
    turned = np.stack([cosine * x + sine * z, y, cosine * z - sine * x], axis=2)
    return np.cumsum(np.concatenate([strands[:, :1], turned], axis=1), axis=1).astype(np.float32)


def turns(before, after):
    """Return (S, P - 1) angles [rad] between the segments of strands in two frames."""
    units = [np.diff(points.astype(np.float64), axis=1) for points in (before, after)]
    units = [segments / np.linalg.norm(segments, axis=2, keepdims=True) for segments in units]
    return 2.0 * np.arcsin(np.linalg.norm(units[1] - units[0], axis=2) / 2.0)


STEP = np.radians(4.0)  # of guides, a frame
FRAMES = STEP * np.arange(-6, 7, 3)
SWINGING = {
    "braid": (braid.Settings(radius=RADIUS, pitch=0.04),),
    "rope": (braid.Settings(pattern="ROPE", radius=RADIUS, pitch=0.04),),
    "ponytail": (clump.Settings(levels=1, amount=1.0, crossover=0.0, stray=0.0),),
    "curl": (curl.Settings(),),
}


@pytest.mark.parametrize("is_bent", [False, True])
@pytest.mark.parametrize("name", SWINGING)
def test_strands_turn_as_their_guides_do(name, is_bent):
    """In a lock of default width nearly all strands turn at most a tenth more than their guides, none twice as far."""
    strands, centre = lock(size=0.025, count=60)
    for angle in FRAMES:
        before, after = (
            stepped(swung(strands, at, is_bent), *SWINGING[name], centres=swung(centre, at, is_bent))
            for at in (angle, angle + STEP)
        )
        found = turns(before, after)
        assert np.quantile(found, 0.95) < 1.1 * STEP and found.max() < 2.0 * STEP


@pytest.mark.parametrize("pattern", ["BRAID", "ROPE"])
def test_strands_do_not_slide_along_their_tress(pattern):
    """Strands do not slide along their tress: a swing of 50° moves points by 1/50 of their root's distance from the
    middle.
    """
    strands, centre = lock(size=0.025, count=60)
    settings = braid.Settings(pattern=pattern, **(EVEN | {"pitch": 0.04}))
    places = []
    for angle in np.radians([-25.0, 0.0, 25.0]):
        made = stepped(swung(strands, angle), settings, centres=swung(centre, angle)).astype(np.float64)
        places.append(made[:, 60:] @ (np.sin(angle), 0.0, np.cos(angle)))
    assert np.ptp(places, axis=0).max() < 0.025 / 50.0


def test_strands_stretch_only_where_they_gather():
    """Strands stretch by half at most where they gather and by a twentieth in the braid, as wholes by a twentieth."""
    strands, centre = lock(size=0.025, count=60)
    for angle in np.radians([0.0, 25.0]):
        before = swung(strands, angle)
        made = stepped(before, braid.Settings(radius=RADIUS, pitch=0.04), centres=swung(centre, angle))
        parts = segment_lengths(made) / segment_lengths(before)
        assert parts.max() < 1.5 + 1e-4
        np.testing.assert_allclose(parts[:, 50:], 1.0, atol=0.05)
        np.testing.assert_allclose(parts.mean(axis=1), 1.0, atol=0.05)


def test_strands_of_any_shape_stretch_by_half_at_most(rng):
    strands = curved_strands(rng)
    made = stepped(strands, braid.Settings(), members=rng.integers(0, 8, len(strands)))
    assert (
        segment_lengths(made.astype(np.float64)) < 1.5001 * segment_lengths(strands.astype(np.float64)) + 1e-7
    ).all()
