# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides get the requested length along their own curves, and roots do not move."""

import numpy as np
import pytest

from hair_addon.core.grooming.guide_lengths import cut, resized
from hair_addon.core.grooming.guide_tool_settings import LengthSettings
from tests.support.strands.combed import distance_to_polylines, lengths, wavy

SHORTEN = ("CUT", "SCALE")


@pytest.mark.parametrize("shorten", SHORTEN)
@pytest.mark.parametrize(
    ("method", "wanted"),
    [
        ("SCALE", lambda present: 0.6 * present),
        ("SET", lambda present: 0.0 * present + 0.15),
        ("MINIMUM", lambda present: np.maximum(present, 0.15)),
        ("MAXIMUM", lambda present: np.minimum(present, 0.15)),
    ],
)
def test_guides_get_their_lengths(rng, shorten, method, wanted):
    points = wavy(rng)
    settings = LengthSettings(method=method, factor=0.6, length=0.15, shorten=shorten)
    changed = resized(points, settings, np.ones(len(points)))
    np.testing.assert_allclose(lengths(changed), wanted(lengths(points)), rtol=2e-5)
    assert np.array_equal(changed[:, 0], points[:, 0])


def test_guides_that_are_long_enough_stay_to_the_last_bit(rng):
    points = wavy(rng)
    for method, is_kept in (("MINIMUM", np.greater), ("MAXIMUM", np.less)):
        settings = LengthSettings(method=method, length=0.2)
        kept = is_kept(lengths(points), 0.2)
        changed = resized(points, settings, np.ones(len(points)))
        assert 0 < kept.sum() < len(points)
        assert np.array_equal(changed[kept], points[kept])
        assert (changed[~kept] != points[~kept]).any(axis=(1, 2)).all()


def test_a_cut_guide_is_a_part_of_what_it_was(rng):
    points = wavy(rng)
    changed = resized(points, LengthSettings(factor=0.37), np.ones(len(points)))
    assert distance_to_polylines(changed, points).max() < 1e-6
    scaled = resized(points, LengthSettings(factor=0.37, shorten="SCALE"), np.ones(len(points)))
    assert distance_to_polylines(scaled, points).max() > 1e-3


def test_scaling_there_and_back_is_nothing(rng):
    points, ones = wavy(rng), np.ones(30)
    there = resized(points, LengthSettings(factor=2.5), ones)
    back = resized(there, LengthSettings(factor=0.4, shorten="SCALE"), ones)
    np.testing.assert_allclose(back, points, atol=1e-6)


@pytest.mark.parametrize("shorten", SHORTEN)
def test_weights_are_shares_of_the_change(rng, shorten):
    points, weights = wavy(rng), np.linspace(0.0, 1.0, 30)
    changed = resized(points, LengthSettings(factor=0.5, shorten=shorten), weights)
    np.testing.assert_allclose(lengths(changed) / lengths(points), 1.0 - 0.5 * weights, rtol=2e-5)
    assert np.array_equal(changed[0], points[0])


def test_a_cut_at_the_tip_changes_nothing(rng):
    points = wavy(rng)
    np.testing.assert_allclose(cut(points, lengths(points)), points, atol=1e-7)


def test_guides_of_two_points_and_guides_without_length(rng):
    straight = wavy(rng, point_count=2)
    changed = resized(straight, LengthSettings(method="SET", length=0.003), np.ones(30))
    np.testing.assert_allclose(lengths(changed), 0.003, rtol=1e-4)
    dots = np.repeat(straight[:, :1], 5, axis=1)
    for method in ("SCALE", "SET", "MINIMUM", "MAXIMUM"):
        settings = LengthSettings(method=method, length=0.1, factor=3.0)
        assert np.array_equal(resized(dots, settings, np.ones(30)), dots)


def test_doubled_points_and_turns_back_are_finite(rng):
    points = wavy(rng)
    points[:, 4] = points[:, 5]
    points[::2, 9:] = points[::2, 7:6:-1]
    changed = resized(points, LengthSettings(factor=0.5), np.ones(30))
    assert np.isfinite(changed).all()
    assert (lengths(changed) <= 0.5 * lengths(points) * 1.001).all()
