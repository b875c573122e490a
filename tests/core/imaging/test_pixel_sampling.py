# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples, moments and tiles of a picture satisfy their laws."""

import numpy as np
import pytest

from hair_addon.core.imaging import pixel_sampling


@pytest.mark.parametrize("count", [1, 2, 4, 7, 8, 9, 16, 17, 18, 36, 64, 1000])
def test_samples_come_in_whole_passes(count):
    side = pixel_sampling.samples_per_side(count)
    assert count % side**2 == 0
    assert all(count % larger**2 for larger in range(side + 1, 5))


@pytest.mark.parametrize("position", ["START", "CENTER", "END"])
def test_moments_divide_the_exposure_evenly(position):
    moments = pixel_sampling.moments(0.5, position, 8)
    np.testing.assert_allclose(np.diff(moments), 0.5 / 8)
    assert moments.mean() == pytest.approx({"START": 0.25, "CENTER": 0.0, "END": -0.25}[position])
    assert np.abs(pixel_sampling.moments(0.0, position, 3)).max() == 0.0


def test_moments_are_where_the_shutter_is_open():
    """Moments follow the shutter curve: each part of the time gets its share, and a curve without light has no
    effect.
    """
    openings = np.repeat([0.0, 1.0, 3.0, 0.0], 64)
    times = pixel_sampling.moments(2.0, "START", 400, openings)
    np.testing.assert_array_equal(np.histogram(times, [0.0, 0.5, 1.0, 1.5, 2.0])[0], [0, 100, 300, 0])
    for even in (np.ones(256), np.zeros(256)):
        np.testing.assert_allclose(pixel_sampling.moments(2.0, "END", 7, even), pixel_sampling.moments(2.0, "END", 7))


@pytest.mark.parametrize(("count", "least"), [(64, 32), (128, 32), (256, 32), (9, 32), (36, 4), (7, 1)])
def test_a_lens_gets_its_passes_where_there_are_samples_for_them(count, least):
    side = pixel_sampling.samples_per_side(count, least)
    passes = count // side**2
    assert passes * side**2 == count and passes >= min(count, least)


@pytest.mark.parametrize("side", [1, 5, 16, 100])
def test_tiles_cover_a_window_once(side):
    covered = np.zeros((50, 60), int)
    for left, bottom, width, height in pixel_sampling.tiles((7, 3, 33, 21), side):
        assert 0 < width <= side and 0 < height <= side
        covered[bottom : bottom + height, left : left + width] += 1
    assert covered.sum() == 33 * 21 and (covered[3:24, 7:40] == 1).all()


@pytest.mark.parametrize("width", [0.0, 1.0, 1.5, 3.0])
@pytest.mark.parametrize("side", [1, 2, 4])
def test_a_filter_is_a_window_around_the_middle_of_a_pixel(side, width):
    """A filter's weights are centered on the pixel over many shifts of the samples, and zero beyond the margin."""
    margin = pixel_sampling.filter_margin(side, width)
    shifts = (np.arange(200) + 0.5) / 200 - 0.5
    weights = np.array([pixel_sampling.filter_weights(side, width, shift) for shift in shifts])
    places = (np.arange(side + 2 * margin) - margin + 0.5 - shifts[:, None]) / side - 0.5
    assert weights.shape == places.shape and (weights >= 0.0).all()
    assert np.sum(weights * places) / weights.sum() == pytest.approx(0.0, abs=1e-3)
    if width > 1.0:
        assert places.min() <= -0.5 * width and places.max() >= 0.5 * width
        np.testing.assert_allclose(weights[np.abs(places) > 0.5 * width], 0.0, atol=1e-4)
        np.testing.assert_allclose(weights.max(), 1.0, atol=1e-3)
