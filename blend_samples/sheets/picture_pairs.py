# SPDX-License-Identifier: GPL-3.0-or-later
"""Differences in color and structure between two pictures of the same hair, and sheets of such pairs."""

import numpy as np

from blend_samples.sheets import picture_files

_WINDOW = 2.0  # deviation [pixels] of the blur before structure is compared
_BLACK = 1e-7  # light that no display shows
_GREY = 0.22  # display value that the mean of the first picture is brought to
_BLOCK = 12  # pixels along each side


def mean(picture):
    """Return (3,) mean color of the hair in a premultiplied picture (H, W, 4)."""
    return picture[..., :3].sum(axis=(0, 1)) / max(float(picture[..., 3].sum()), 1e-9)


def ratio(reference, picture):
    """Return (3,) mean color of a picture, relative to that of a reference; one where both are black."""
    return (mean(picture) + _BLACK) / (mean(reference) + _BLACK)


def deviation(reference, picture):
    """Return the largest deviation of `ratio` from one in a channel."""
    return float(np.abs(ratio(reference, picture) - 1.0).max())


def structure(reference, picture):
    """Structural similarity [Wang04] of the brightness as displayed, both blurred: one for equal pictures."""
    exposure = _exposure(reference)
    first, second = (_blurred(_displayed(one, exposure).mean(axis=-1)) for one in (reference, picture))
    means = _blurred(first, 3.0), _blurred(second, 3.0)
    variances = [_blurred(one * one, 3.0) - mean * mean for one, mean in zip((first, second), means, strict=True)]
    covariance = _blurred(first * second, 3.0) - means[0] * means[1]
    similarity = (2.0 * means[0] * means[1] + 1e-4) * (2.0 * covariance + 9e-4)
    similarity /= (means[0] ** 2 + means[1] ** 2 + 1e-4) * (sum(variances) + 9e-4)
    weights = _blurred(np.maximum(reference[..., 3], picture[..., 3]), 3.0)
    return float((similarity * weights).sum() / weights.sum())


def block_error(reference, picture):
    """Return the mean difference of the means of 12 × 12 pixels with hair, in display levels of 255.

    Noise of single pixels hardly matters. NaN if no block is at least a quarter hair.
    """
    exposure = _exposure(reference)
    first, second = (_block_means(255.0 * _displayed(one, exposure)) for one in (reference, picture))
    is_hair = _block_means(np.maximum(reference[..., 3:], picture[..., 3:]))[..., 0] > 0.25
    return float(np.abs(second - first)[is_hair].mean()) if is_hair.any() else float("nan")


def noiseless_block_error(halves, picture):
    """Return an estimate of the `block_error` of a picture against a reference without noise.

    halves: two noisy pictures of the reference, each with half of its samples. Display curves are concave, so noise
    darkens displayed pixels and their means. Each half has twice the bias of both together, so their difference
    removes the bias [Quenouille56].
    """
    reference = 0.5 * (halves[0] + halves[1])
    exposure = _exposure(reference)
    means = [_block_means(255.0 * _displayed(one, exposure)) for one in (reference, *halves, picture)]
    expected = 2.0 * means[0] - 0.5 * (means[1] + means[2])
    is_hair = _block_means(np.maximum(reference[..., 3:], picture[..., 3:]))[..., 0] > 0.25
    return float(np.abs(means[3] - expected)[is_hair].mean()) if is_hair.any() else float("nan")


def _block_means(values):
    """(H, W, C) → (H / 12, W / 12, C)."""
    height, width = (length // _BLOCK for length in values.shape[:2])
    cut = values[: height * _BLOCK, : width * _BLOCK].reshape(height, _BLOCK, width, _BLOCK, -1)
    return cut.mean(axis=(1, 3))


def _blurred(values, deviation=_WINDOW):
    taps = np.arange(-int(3 * deviation), int(3 * deviation) + 1)
    weights = np.exp(-0.5 * np.square(taps / deviation))
    for axis in (0, 1):
        padded = np.pad(values, [(len(taps) // 2,) * 2 if one == axis else (0, 0) for one in (0, 1)], mode="edge")
        values = np.apply_along_axis(np.convolve, axis, padded, weights / weights.sum(), "valid")
    return values


def _exposure(reference):
    return _GREY / max(float(mean(reference).mean()), 1e-4)


def _displayed(picture, exposure):
    """Return (H, W, 3) from 0 to 1: premultiplied light over black, as sRGB with a soft shoulder."""
    light = np.maximum(picture[..., :3], 0.0) * exposure
    light = light * (1.0 + light / 9.0) / (1.0 + light)  # white at three times the middle of the curve
    return np.where(light < 0.0031308, 12.92 * light, 1.055 * np.power(np.maximum(light, 1e-9), 1 / 2.4) - 0.055).clip(
        0.0, 1.0
    )


def write_sheet(pairs, path, columns=5):
    """Write [(caption, reference, picture), ...] as a PNG, each reference above its picture, first rows first."""
    height, width = pairs[0][1].shape[:2]
    line, gap = 20, 4
    cell = (2 * height + line + gap, width + gap)
    rows = -(-len(pairs) // columns)
    sheet = np.full((rows * cell[0], columns * cell[1], 3), 24, np.uint8)
    words = []
    for index, (caption, *pictures) in enumerate(pairs):
        top, left = (index // columns) * cell[0], (index % columns) * cell[1]
        words.append((caption, left + 4, top + 15))
        for turn, picture in enumerate(pictures):
            shown = np.rint(255.0 * _displayed(picture, _exposure(pictures[0]))[::-1])
            start = top + line + turn * height
            sheet[start : start + height, left : left + width] = shown.astype(np.uint8)
    picture_files.write(sheet, path, words)
