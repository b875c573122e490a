# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth attenuates waves, and leaves smooth strands unchanged."""

import numpy as np
import pytest

from hair_addon.core.geometry.strands import segment_lengths
from hair_addon.core.styling import smooth
from tests.support.dynamics.stepped import curved_strands, stepped, straight_strands


def wave(wavelength, size=2e-4, length=1.0, point_count=241):
    """Return (1, P, 3): a strand that waves slightly about a line."""
    s = np.linspace(0.0, length, point_count)
    points = np.stack([size * np.sin(2.0 * np.pi * s / wavelength), 0.0 * s, s], axis=1)
    return points[None].astype(np.float32)


@pytest.mark.parametrize("part", [0.25, 0.5, 0.75, 1.0])
def test_what_is_left_of_a_wave_is_sinc_squared(part):
    """Smoothing scales a wave by sinc squared, except near the ends, where it averages less of the strand."""
    strand = wave(0.1)
    made = stepped(strand, smooth.Settings(length=0.1 * part))
    inner = slice(60, 180)
    slopes = [np.diff(points[0, :, 0]) / np.diff(points[0, :, 2]) for points in (strand, made)]
    left = np.std(slopes[1][inner]) / np.std(slopes[0][inner])
    assert left == pytest.approx(np.sinc(part) ** 2, abs=0.02)


def test_a_straight_strand_stays():
    strands = straight_strands(5, 0.2)
    np.testing.assert_allclose(stepped(strands, smooth.Settings(length=0.05)), strands, atol=1e-6 * 0.2)


def test_twice_the_length_makes_strands_straight(rng):
    strands = curved_strands(rng)
    made = stepped(strands, smooth.Settings(length=10.0)).astype(np.float64)
    reach = np.linalg.norm(made[:, -1] - made[:, 0], axis=1)
    np.testing.assert_allclose(reach, segment_lengths(made).sum(axis=1), rtol=1e-6)
    # It points where the whole strand did.
    old = strands[:, -1] - strands[:, 0]
    ahead = np.einsum("sc,sc->s", made[:, -1] - made[:, 0], old) / reach / np.linalg.norm(old, axis=1)
    np.testing.assert_allclose(ahead, 1.0, atol=1e-5)


def test_smoothing_does_not_bend(rng):
    """Smoothing does not bend strands: the sum of angles between segments does not grow."""

    def bending(points):
        segments = np.diff(points.astype(np.float64), axis=1)
        segments /= np.linalg.norm(segments, axis=-1, keepdims=True)
        cosines = (segments[:, 1:] * segments[:, :-1]).sum(axis=-1)
        return np.arccos(np.clip(cosines, -1.0, 1.0)).sum(axis=1)

    strands = curved_strands(rng)
    rough = strands.copy()
    rough[:, 1:] += rng.normal(0.0, 5e-4, rough[:, 1:].shape)
    assert np.all(bending(stepped(rough, smooth.Settings(length=0.04))) < 0.5 * bending(rough))
    assert np.all(bending(stepped(strands, smooth.Settings(length=0.04))) < 1.001 * bending(strands) + 1e-3)
