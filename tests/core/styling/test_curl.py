# SPDX-License-Identifier: GPL-3.0-or-later
"""Laws of Curl: helices on straight strands, waves in a plane, locks in one phase."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from hair_addon.core.styling import curl, frizz
from tests.support.slid import steepest_moves
from tests.support.stepped import stepped, straight_strands

ALL = {"root": 1.0, "tip": 1.0, "start": 0.0}


def helix(**settings):
    """Settings of ten points a turn or more, without random numbers."""
    return curl.Settings(**({"radius": 0.004, "pitch": 0.04, "coherence": 1.0, **ALL} | settings))


def winding(points):
    """(S,) turns about the Z axis through each root, by which strands wind to the left."""
    away = points[:, :, :2] - points[:, :1, :2]
    angle = np.unwrap(np.arctan2(away[:, 12:, 1], away[:, 12:, 0]), axis=1)
    return (angle[:, -1] - angle[:, 0]) / (2.0 * np.pi)


@pytest.mark.parametrize("point_count", [41, 81])
def test_a_straight_strand_winds_at_the_radius(point_count):
    """About the axis of its coil, once the radius has grown to its full size."""
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


def test_a_coil_reaches_as_far_as_its_pitch_says():
    """Of a strand with ten points a turn; less the first half turn, over which the radius grows."""
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
    """But for the sense that they wind in; a change takes three tenths of the distance."""
    strands = straight_strands(200, 0.3)
    members = np.arange(200)
    kept = winding(stepped(strands, helix(left_handed=0.0), members=members))
    far = winding(stepped(strands, helix(left_handed=0.0, switchback=1e3), members=members))
    is_same = np.abs(np.abs(far) / np.abs(kept) - 1.0) < 1e-3
    assert is_same.mean() > 0.7
    assert (far[is_same] < 0.0).mean() == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("style", [curl.Settings(), frizz.Settings()], ids=["curl", "frizz"])
def test_strands_that_turn_back_change_by_degrees(style):
    """Where a strand turns by 170° from segment to segment its frames turn with it, without a jump."""
    strands = straight_strands(8)
    angles = np.radians(170.0) * (np.arange(40) >= 20)
    segments = 0.005 * np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], axis=1)
    strands[:, 1:] = strands[:, :1] + np.cumsum(segments, axis=0)
    amounts = np.linspace(0.0, 1.0, 33)
    moves = list(islice(steepest_moves(lambda amount: stepped(strands, replace(style, amount=amount)), amounts), 12))
    assert moves[-1] < 0.01 * moves[0]
