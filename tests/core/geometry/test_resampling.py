# SPDX-License-Identifier: GPL-3.0-or-later
"""Resampled points lie on their curve, equally spaced, and a Catmull-Rom spline runs through its points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.curves import resampling

COUNTS = st.lists(st.integers(1, 12), min_size=1, max_size=6)


def ragged(seed, counts):
    generator = np.random.default_rng(seed)
    return generator.normal(size=(sum(counts), 3)).astype(np.float32), np.concatenate([[0], np.cumsum(counts)])


@given(seed=st.integers(0, 2**32 - 1), counts=COUNTS)
def test_points_of_polylines_are_evenly_spaced_along_their_own_line(seed, counts):
    points, starts = ragged(seed, counts)
    found = resampling.resample(points, starts, 17)
    for line, resampled in zip(np.split(points.astype(float), starts[1:-1]), found, strict=True):
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        wanted = np.linspace(0.0, along[-1], 17)
        expected = np.stack([np.interp(wanted, along, axis) for axis in line.T], axis=1)
        np.testing.assert_allclose(resampled, expected, atol=2e-5)


def test_repeated_points_are_passed_over():
    line = np.float32([(0, 0, 0), (0, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0), (2, 0, 0), (2, 0, 0)])
    np.testing.assert_allclose(resampling.resample(line, [0, 7], 5)[0, :, 0], [0.0, 0.5, 1.0, 1.5, 2.0])


@given(seed=st.integers(0, 2**32 - 1), counts=COUNTS, is_smooth=st.booleans())
def test_ends_are_kept_to_the_last_bit(seed, counts, is_smooth):
    points, starts = ragged(seed, counts)
    found = resampling.resample(points, starts, 9, np.full(len(counts), is_smooth))
    np.testing.assert_array_equal(found[:, 0], points[starts[:-1]])
    np.testing.assert_array_equal(found[:, -1], points[starts[1:] - 1])


def test_a_spline_runs_through_its_points_and_is_rounder_than_a_polyline(rng):
    turn = np.linspace(0.0, np.pi, 7)
    arc = np.float32(np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1))
    smooth, straight = resampling.resample(np.tile(arc, (2, 1)), [0, 7, 14], 601, np.array([True, False]))
    for point in arc:
        assert np.linalg.norm(smooth - point, axis=1).min() < 0.01
    error = [abs(np.linalg.norm(line, axis=1) - 1.0).max() for line in (smooth, straight)]
    assert error[0] < 0.02 < error[1]


def test_collinear_even_points_of_a_spline_stay_on_the_line():
    """Inner segments of a uniform Catmull-Rom spline through equally spaced points of a line are that line."""
    line = np.float32([(0.1 * i, 0.2 * i, 0.0) for i in range(9)])
    found = resampling.resample(line, [0, 9], 41, np.array([True]))[0]
    np.testing.assert_allclose(found[:, 1], 2.0 * found[:, 0], atol=1e-6)
    np.testing.assert_allclose(np.diff(found[:, 0]), 0.02, atol=1e-4)


@pytest.mark.parametrize("bad", ["empty", "nan", "starts", "smooth"])
def test_out_of_bounds_reads_are_refused(bad):
    points, starts, is_smooth, error = np.ones((4, 3), np.float32), [0, 2, 4], None, ValueError
    if bad == "empty":
        starts, error = [0, 2, 2, 4], HairError
    elif bad == "nan":
        points[1, 1], error = np.nan, HairError
    elif bad == "starts":
        starts = [0, 2, 9]
    else:
        is_smooth = np.ones(5, bool)
    with pytest.raises(error):
        resampling.resample(points, starts, 5, is_smooth)
