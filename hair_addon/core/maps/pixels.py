# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of the pixels of images to masks and colors in scene-linear floats."""

from functools import cache

import numpy as np

MOST_SIDE = 2048  # texels along a side: larger images are averaged to limit memory

_ROWS_AT_ONCE = 256


def masks(
    pixels: np.ndarray, is_srgb: bool = False, has_alpha: bool = True, is_premultiplied: bool = False
) -> np.ndarray:
    """Return (H, W, 1) float32 masks of (H, W, C) pixels: the mean of their colors times alpha."""
    return _reduced(pixels, lambda rows: _mask(_premultiplied(rows, is_srgb, has_alpha, is_premultiplied)))


def colors(
    pixels: np.ndarray, is_srgb: bool = False, has_alpha: bool = True, is_premultiplied: bool = False
) -> np.ndarray:
    """Return (H, W, 4) float32 of (H, W, C) pixels: linear colors multiplied by alpha, and alpha.

    is_srgb: pixels are encoded for display; has_alpha: the last of two or four channels is alpha, otherwise this
    channel is ignored; is_premultiplied: colors are already multiplied by alpha. Images larger than `MOST_SIDE` are
    averaged.
    """
    return _reduced(pixels, lambda rows: _premultiplied(rows, is_srgb, has_alpha, is_premultiplied))


def changed_box(before: np.ndarray, now: np.ndarray) -> tuple[slice, slice] | None:
    """Return the slices of the rows and columns in which images (H, W, C) float32 differ; None if all bits agree."""
    floats = (np.ascontiguousarray(pixels, np.float32).reshape(len(pixels), -1) for pixels in (before, now))
    word = np.int64 if now.shape[2] % 2 == 0 else np.int32
    bits = [values.view(word) for values in floats]
    rows = np.flatnonzero((bits[0] != bits[1]).any(axis=1))
    if not len(rows):
        return None
    changed = slice(int(rows[0]), int(rows[-1]) + 1)
    texels = np.flatnonzero((bits[0][changed] != bits[1][changed]).any(axis=0)) // (
        now.shape[2] * 4 // np.dtype(word).itemsize
    )
    return changed, slice(int(texels[0]), int(texels[-1]) + 1)


def unpremultiplied(means: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return colors (S, 3) and alpha (S,) in [0, 1] for means (S, 4) of `colors`; colors without alpha are black."""
    alpha = means[:, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        found = means[:, :3] / alpha[:, None]
    # A color with full alpha stays bit-identical.
    found = np.where(alpha[:, None] == 1.0, means[:, :3], np.where(alpha[:, None] > 0.0, found, 0.0))
    return np.where(np.isnan(alpha)[:, None], np.nan, found), np.clip(alpha, 0.0, 1.0)


def _mask(colored):
    first = colored[..., :1]
    is_gray = (colored[..., 1:3] == first).all(axis=-1, keepdims=True)
    return np.where(is_gray, first, colored[..., :3].mean(axis=-1, keepdims=True)).astype(np.float32)


def _premultiplied(rows, is_srgb, has_alpha, is_premultiplied):
    """Return premultiplied colors (H, W, 4) of rows (H, W, C); non-finite and negative components become 0."""
    rows = np.where(np.isfinite(rows), rows, np.float32(0.0))
    channels = rows.shape[2]
    found = np.ones((*rows.shape[:2], 4), np.float32)
    color = rows[..., :3] if channels >= 3 else rows[..., :1]
    found[..., :3] = np.maximum(linear(color) if is_srgb else color, 0.0)
    if has_alpha and channels in (2, 4):
        found[..., 3] = np.clip(rows[..., -1], 0.0, 1.0)
        if not is_premultiplied:
            found[..., :3] *= found[..., 3:]
    return found


def linear(encoded: np.ndarray) -> np.ndarray:
    """Return linear float32 values for 8-bit sRGB values, given as floats from 0 to 1 (IEC 61966-2-1)."""
    return _linear_bytes()[np.rint(np.clip(encoded, 0.0, 1.0) * 255.0).astype(np.uint8)]


@cache
def _linear_bytes():
    values = np.arange(256) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _reduced(pixels, convert):
    """Return pixels converted in blocks of rows, and averaged by a power of two if a side exceeds `MOST_SIDE`."""
    height, width = pixels.shape[:2]
    step = 1
    while max(height, width) > step * MOST_SIDE:
        step *= 2
    blocks = []
    rows = max(_ROWS_AT_ONCE // step, 1) * step
    for first in range(0, height, rows):
        block = convert(pixels[first : first + rows])
        if step > 1:
            block = np.pad(block, ((0, -len(block) % step), (0, -width % step), (0, 0)), mode="edge")
            block = block.reshape(len(block) // step, step, block.shape[1] // step, step, -1).mean(axis=(1, 3))
        blocks.append(block)
    return np.concatenate(blocks)


def reduced_size(width: int, height: int) -> tuple[int, int]:
    """Return (width, height) of the results of `masks` and `colors`."""
    step = 1
    while max(height, width) > step * MOST_SIDE:
        step *= 2
    return -(-width // step), -(-height // step)
