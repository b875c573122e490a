# SPDX-License-Identifier: GPL-3.0-or-later
"""Curl winds straight strands into helices, waves lie in a plane, and locks have one phase."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from hair_addon.core.styling import clump, curl, frizz
from tests.support.dynamics.slid import steepest_moves
from tests.support.dynamics.stepped import UP, stepped, straight_strands

ALL = {"root": 1.0, "tip": 1.0, "start": 0.0}


def helix(**settings):
    """Return settings of ten points per turn or more, without random numbers."""
    return curl.Settings(**({"radius": 0.004, "pitch": 0.04, "coherence": 1.0, **ALL} | settings))


def winding(points):
    """Return (S,) turns to the left of strands around the Z axis through their roots."""
    away = points[:, :, :2] - points[:, :1, :2]
    angle = np.unwrap(np.arctan2(away[:, 12:, 1], away[:, 12:, 0]), axis=1)
    return (angle[:, -1] - angle[:, 0]) / (2.0 * np.pi)


@pytest.mark.parametrize("point_count", [41, 81])
def test_a_straight_strand_winds_at_the_radius(point_count):
    """A straight strand winds at the radius around the axis of its coil, once the radius has grown fully."""
    settings = helix(left_handed=0.0)
    points = stepped(straight_strands(1, 0.3, point_count), settings)[0].astype(np.float64)
    turn = curl.turn_length(settings)
    wound = points[np.linspace(0.0, 0.3, point_count) > 0.6 * turn][:, :2]
    # The root lies off the axis by as much as the ramp has moved the strand.
    system = np.column_stack([2.0 * wound, np.ones(len(wound))])
    centre_x, centre_y, rest = np.linalg.lstsq(system, (wound**2).sum(axis=1), rcond=None)[0]
    radii = np.hypot(*(wound - (centre_x, centre_y)).T)
    np.testing.assert_allclose(radii, 0.004, rtol=2e-4)
    assert np.sqrt(rest + centre_x**2 + centre_y**2) == pytest.approx(0.004, rel=1e-4)


@pytest.mark.parametrize("part, sign", [(0.0, 1), (1.0, -1)])
def test_handedness_is_exact(part, sign):
    points = stepped(straight_strands(50, 0.3), helix(left_handed=part, coherence=0.0), members=np.arange(50))
    turns = winding(points)
    assert np.all(np.sign(turns) == sign)
    assert np.abs(turns).min() > 3.0


def test_a_part_of_the_locks_winds_to_the_left():
    members = np.arange(400)
    turns = winding(stepped(straight_strands(400, 0.3), helix(left_handed=0.3), members=members))
    assert (turns < 0.0).mean() == pytest.approx(0.3, abs=0.07)


def test_locks_vary_in_pitch_and_strands_of_a_lock_do_not():
    """Locks vary evenly around the pitch by the given fraction, and the strands of a lock have the same number of
    turns.
    """
    members = np.repeat(np.arange(200), 2)
    settings = helix(left_handed=0.0, radius=0.001, pitch_vary=0.3)
    strands = straight_strands(400, 0.3, 101)
    turns = winding(stepped(strands, settings, members=members)).reshape(200, 2)
    np.testing.assert_allclose(turns[:, 0], turns[:, 1], rtol=1e-3)
    same = winding(stepped(strands, replace(settings, pitch_vary=0.0), members=members)).mean()
    ratios = same / turns[:, 0]  # of the pitch of each lock to the pitch
    assert 0.68 < ratios.min() < 0.73 and 1.27 < ratios.max() < 1.32
    assert ratios.mean() == pytest.approx(1.0, abs=0.03)


def test_a_coil_reaches_as_far_as_its_pitch_says():
    """A coil reaches as far as its pitch says with ten points per turn, except in the first half turn."""
    settings = helix(radius=0.005, pitch=0.03)
    turn = curl.turn_length(settings)
    points = stepped(straight_strands(1, 10 * turn, 101), settings)[0]
    reach = points[-1, 2] - points[10, 2]
    assert reach == pytest.approx(9 * 0.03, rel=0.03)


def test_a_flat_curl_stays_in_a_plane():
    points = stepped(straight_strands(30, 0.3), helix(flatness=1.0), members=np.arange(30)).astype(np.float64)
    for strand in points:
        sizes = np.linalg.svd(strand - strand.mean(axis=0))[1]
        assert sizes[2] < 1e-6 * 0.3
        assert sizes[1] > 0.01


def test_coherent_strands_of_a_lock_have_one_phase():
    strands = straight_strands(40, 0.3)
    lock = stepped(strands, helix()) - strands
    np.testing.assert_allclose(lock, np.broadcast_to(lock[:1], lock.shape), atol=1e-5 * 0.3)
    apart = stepped(strands, helix(), members=np.arange(40)) - strands
    assert np.median(np.abs(apart - apart[:1])[1:].max(axis=(1, 2))) > 5e-3


def test_strands_without_coherence_have_phases_of_their_own():
    strands = straight_strands(300, 0.3)
    points = stepped(strands, helix(coherence=0.0, left_handed=0.0))
    away = points[:, 20, :2] - strands[:, 20, :2]
    phases = np.arctan2(away[:, 1], away[:, 0])
    assert abs(np.exp(1j * phases).mean()) < 0.15


def test_without_preserved_length_strands_reach_as_far_as_before():
    strands = straight_strands(5, 0.3)
    points = stepped(strands, helix(keep_length=0.0))
    np.testing.assert_allclose(points[:, -1, 2], 0.3, rtol=1e-5)
    grown = np.linalg.norm(np.diff(points, axis=1), axis=-1).sum(axis=1)
    settings = helix()
    np.testing.assert_allclose(grown, 0.3 * curl.turn_length(settings) / settings.pitch, rtol=0.03)


def test_switchbacks_wind_back():
    """A coil whose handedness changes has fewer turns than one that keeps it, and as much length."""
    strands = straight_strands(60, 0.4, 161)
    members = np.arange(60)
    kept = winding(stepped(strands, helix(left_handed=0.0), members=members))
    changing = winding(stepped(strands, helix(left_handed=0.0, switchback=0.05), members=members))
    assert np.abs(changing).mean() < 0.7 * np.abs(kept).mean()
    assert np.any(changing < 0.0) and np.any(changing > 0.0)


def test_switchbacks_that_are_far_apart_leave_most_coils_alone():
    """Switchbacks that are far apart leave most coils alone, as a change takes three tenths of their distance."""
    strands = straight_strands(200, 0.3)
    members = np.arange(200)
    kept = winding(stepped(strands, helix(left_handed=0.0), members=members))
    far = winding(stepped(strands, helix(left_handed=0.0, switchback=1e3), members=members))
    is_same = np.abs(np.abs(far) / np.abs(kept) - 1.0) < 1e-3
    assert is_same.mean() > 0.7
    assert (far[is_same] < 0.0).mean() == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("style", [curl.Settings(), frizz.Settings()], ids=["curl", "frizz"])
def test_strands_that_turn_back_change_by_degrees(style):
    """Strands that turn back by 170° between segments change gradually, as their frames turn without a jump."""
    strands = straight_strands(8)
    angles = np.radians(170.0) * (np.arange(40) >= 20)
    segments = 0.005 * np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], axis=1)
    strands[:, 1:] = strands[:, :1] + np.cumsum(segments, axis=0)
    amounts = np.linspace(0.0, 1.0, 33)
    moves = list(islice(steepest_moves(lambda amount: stepped(strands, replace(style, amount=amount)), amounts), 12))
    assert moves[-1] < 0.01 * moves[0]


def bent_lock(rng, count=60, length=0.24, point_count=121, normal=1.0):
    """Return strands that bend over from a disc of 10 mm, and the one in the middle: (S, P, 3), (1, P, 3), normals.

    normal: -1 where normals point into the surface.
    """
    radius, angle = 0.01 * np.sqrt(rng.random(count)), rng.uniform(0.0, 2.0 * np.pi, count)
    roots = np.pad(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1), ((1, 0), (0, 1)))
    bend = 1.6 + 8.0 * roots[:, :1]
    around = 6.0 * roots[:, 1:2]
    along = np.linspace(0.0, 1.0, point_count - 1)
    tilt = np.minimum(0.2 + 3.0 * along, 1.0) * bend
    segments = np.stack([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)], axis=-1)
    path = np.pad(np.cumsum(segments * length / (point_count - 1), axis=1), ((0, 0), (1, 0), (0, 0)))
    strands = (roots[:, None] + path).astype(np.float32)
    normals = np.stack([4.0 * roots[1:, 0], 4.0 * roots[1:, 1], np.ones(count)], axis=1)
    return strands[1:], strands[:1], normal * normals / np.linalg.norm(normals, axis=1, keepdims=True)


def distances_to(points, line):
    """Return (N,) distances [m] from points (N, 3) to a curve through points (P, 3)."""
    fine = np.linspace(0.0, len(line) - 1.0, 8 * len(line))
    dense = np.stack([np.interp(fine, np.arange(len(line)), line[:, k]) for k in range(3)], axis=1)
    return np.linalg.norm(points[:, None] - dense, axis=-1).min(axis=1)


def root_mean_square(values):
    return np.sqrt((values**2).mean())


@pytest.mark.parametrize("normal", [1.0, -1.0])
def test_a_clumped_lock_is_one_ringlet(normal, rng):
    """A clumped lock is one ringlet: strands from different places along it are as close as without curls."""
    strands, centre, normals = bent_lock(rng, normal=normal)
    where = {"centres": centre, "normals": normals, "centre_normals": normal * UP}
    gathered = clump.Settings(levels=1, thickness=0.03, shape=0.1, stray=0.0)
    ringlet = helix(radius=0.007, pitch=0.036)
    lock, wound = (stepped(strands, *styles, **where) for styles in ((gathered,), (gathered, ringlet)))
    assert np.abs(wound - lock)[:, 60:].max() > 0.01
    spreads = [
        np.mean(
            [root_mean_square(distances_to(points[1:, i], points[0].astype(np.float64))) for i in range(50, 115, 5)]
        )
        for points in (lock, wound)
    ]
    assert spreads[1] < 1.4 * spreads[0]


def test_strands_that_slide_along_a_crooked_centre_change_by_degrees():
    """Strands change gradually from one segment of the center to the next, although these differ by ten degrees."""
    bend = np.linspace(0.0, 1.0, 40)
    crooked = bend + 0.1 * (-1.0) ** np.arange(40)
    centre, smooth = (
        np.cumsum([[0.0, 0.0, 0.0], *(0.005 * np.array([np.sin(a), 0.0, np.cos(a)]) for a in angles)], axis=0)
        for angles in (crooked, bend)
    )
    step = 2.5e-5
    slid = np.arange(400)[:, None] * np.array([0.0, 0.0, step]) + np.array([0.01, 0.01, 0.0])
    beside = (smooth + slid[:, None]).astype(np.float32)
    styles = clump.Settings(thickness=1.0), helix()
    made = stepped(beside, *styles, centres=centre[None], identities=np.zeros(400)).astype(np.float64)
    assert np.linalg.norm(np.diff(made - made[:, :1], axis=0), axis=2).max() < 2.0 * step


def test_strands_of_a_lock_that_are_cut_wind_as_the_others(rng):
    """Strands that are cut wind as the others of their lock, as turns have places along the lock."""
    strands, centre, normals = bent_lock(rng)
    where = {"centres": centre, "normals": normals}
    gathered, ringlet = clump.Settings(levels=1, thickness=0.0, amount=1.0, root=1.0, stray=0.0), helix(pitch=0.036)
    short = strands.copy()
    short[:30] = short[:30, :1] + 0.8 * (short[:30] - short[:30, :1])
    made = stepped(short, gathered, ringlet, **where).astype(np.float64)
    assert root_mean_square(distances_to(made[:30, 80], made[45])) < 1.8e-3


def test_strands_that_leave_their_lock_go_on_by_themselves(rng):
    """Strands that leave their lock, as they grow opposite to its center, wind as often as single strands."""
    strands, centre, _ = bent_lock(rng, count=8)
    away = strands * (-1.0, 1.0, 1.0)
    tilted = clump.Settings(levels=1, amount=1e-6, stray=0.0)
    made = stepped(away.astype(np.float32), tilted, helix(), centres=centre)
    alone = stepped(away.astype(np.float32), helix())
    reaches = [np.linalg.norm(points[:, -1] - points[:, 0], axis=1) for points in (made, alone)]
    np.testing.assert_allclose(*reaches, rtol=0.05)
