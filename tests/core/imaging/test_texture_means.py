# SPDX-License-Identifier: GPL-3.0-or-later
"""Means of images over triangles equal integrals."""

import numpy as np
import pytest

from hair_addon.core.imaging.texture_means import triangle_means


def test_the_mean_of_a_gradient_is_its_value_at_the_center(rng):
    """Over small and large triangles alike, the mean of a linear function is its value at their center."""
    u, v = np.meshgrid((np.arange(256) + 0.5) / 256, (np.arange(128) + 0.5) / 128)
    picture = np.stack([u, v, 0.3 + 0.2 * u - 0.1 * v], axis=-1).astype(np.float32)
    corners = rng.random((300, 3, 2))
    corners[100:] = corners[100:, :1] + 0.02 * (corners[100:] - 0.5)
    corners = np.clip(corners, 0.0, 1.0)
    centers = corners.mean(axis=1)
    expected = np.stack([*centers.T, 0.3 + 0.2 * centers[:, 0] - 0.1 * centers[:, 1]], axis=-1)
    np.testing.assert_allclose(triangle_means(picture, corners.reshape(-1, 2)), expected, atol=0.006)


def test_two_triangles_have_the_mean_of_the_image(rng):
    """The halves of a square average all pixels, also of noise, far beyond the image where it repeats."""
    picture = rng.random((512, 512, 3), dtype=np.float32) ** 4
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)], np.float32)
    for places, extension in ((square, "EXTEND"), (5.0 * square - 2.0, "REPEAT"), (4.0 * square, "MIRRORED_REPEAT")):
        found = triangle_means(picture, places, extension).mean(axis=0)
        np.testing.assert_allclose(found, picture.mean(axis=(0, 1)), rtol=0.02)


def test_outside_of_an_image_is_its_border_or_nothing():
    picture = np.zeros((4, 4, 1), np.float32)
    picture[:, 3] = 1.0
    far = np.array([(5.0, 0.2), (6.0, 0.2), (5.0, 0.8)])
    assert triangle_means(picture, far, "EXTEND") == 1.0
    assert triangle_means(picture, far, "CLAMP_TO_BORDER") == 0.0
    assert triangle_means(picture, far / np.nan, "REPEAT") == pytest.approx(0.25)
    assert triangle_means(picture, np.zeros((0, 2))).shape == (0, 1)
