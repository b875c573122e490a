# SPDX-License-Identifier: GPL-3.0-or-later
"""Frizz has its size and spectrum, and neighbors are alike by its coherence."""

import numpy as np
import pytest

from hair_addon.core.styling import frizz
from tests.support.dynamics.stepped import stepped, straight_strands

LENGTH, POINTS = 0.3, 129


def offsets(count=600, strands=None, **settings):
    """Return (S, P, 2) offsets [m] of straight strands from a line through their root."""
    given = {"amplitude": 2e-4, "wavelength": 0.03, "root": 1.0, "tip": 1.0, "stray": 0.0}
    strands = straight_strands(count, LENGTH, POINTS, 1e-3) if strands is None else strands
    points = stepped(strands, frizz.Settings(**(given | settings)))
    return (points - strands)[:, :, :2].astype(np.float64)


@pytest.mark.parametrize("octaves", [1, 2, 3])
def test_the_amplitude_is_the_root_mean_square(octaves):
    """The amplitude is the root mean square of each coordinate, and of differences twice the square."""
    rho = offsets(2000, octaves=octaves, amplitude=1e-4)
    square = ((rho[:, 60:] - rho[:, :1]) ** 2).mean()
    assert np.sqrt(0.5 * square) == pytest.approx(1e-4, rel=0.03)


@pytest.mark.parametrize("octaves", [1, 2])
def test_there_are_no_waves_beyond_the_band(octaves):
    """There are no waves beyond the band: at most one part in a hundred of the energy is beyond twice the highest
    frequency.
    """
    rho = offsets(octaves=octaves, amplitude=5e-5, wavelength=0.04)
    rho -= rho.mean(axis=1, keepdims=True)
    window = np.hanning(POINTS)[None, :, None]
    energy = (np.abs(np.fft.rfft(rho * window, axis=1)) ** 2).sum(axis=(0, 2))
    frequencies = np.fft.rfftfreq(POINTS, LENGTH / (POINTS - 1))
    highest = 2.0 ** (octaves - 1) * 2.0**0.5 / 0.04
    assert energy[frequencies > 2.0 * highest].sum() < 0.01 * energy.sum()
    assert energy[(frequencies > 0.5 / 0.04) & (frequencies < 1.5 * highest)].sum() > 0.8 * energy.sum()


def test_neighbours_without_coherence_are_independent():
    rho = offsets(coherence=0.0)[:, 40:] - offsets(coherence=0.0)[:, :1]
    pairs = np.corrcoef(rho[:-1].ravel(), rho[1:].ravel())[0, 1]
    assert abs(pairs) < 0.05


def test_coherent_neighbours_are_alike_and_distant_strands_are_not():
    strands = straight_strands(400, LENGTH, POINTS, 0.02 / 20)
    rho = offsets(strands=strands, coherence=1.0, spread=0.02)
    assert np.corrcoef(rho[:-1].ravel(), rho[1:].ravel())[0, 1] > 0.95
    assert abs(np.corrcoef(rho[:-200].ravel(), rho[200:].ravel())[0, 1]) < 0.3


def test_waves_that_points_cannot_carry_are_left_out():
    """Waves below two segments are left out, so the strand stays; longer waves displace it."""
    assert np.abs(offsets(50, wavelength=1.4 * LENGTH / (POINTS - 1), octaves=1)).max() < 1e-6
    assert np.abs(offsets(50, wavelength=0.05, octaves=1)).max() > 1e-4


def test_strays_go_further():
    calm, stray = offsets(300, stray=0.0), offsets(300, stray=1.0, stray_gain=3.0)
    sizes = np.linalg.norm(stray, axis=2).max(axis=1) / np.linalg.norm(calm, axis=2).max(axis=1)
    assert np.median(sizes) == pytest.approx(3.0, rel=0.1)
    some = np.linalg.norm(offsets(2000, stray=0.2) - offsets(2000, stray=0.0), axis=2).max(axis=1) > 1e-6
    assert some.mean() == pytest.approx(0.2, abs=0.03)


def test_as_large_at_the_root_as_the_profile_says():
    """With a profile from 0 to 1 the noise grows along the strand."""
    rho = np.linalg.norm(offsets(root=0.0, shape=0.5), axis=2).mean(axis=0)
    assert rho[1:10].mean() < 0.2 * rho[-20:].mean()
