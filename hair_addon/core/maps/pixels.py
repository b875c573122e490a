# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of the pixels of images to masks and colors in scene-linear floats."""

from functools import cache

import numpy as np
import warp as wp

from ..kernels import parallel

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

MOST_SIDE = 2048  # texels along a side: larger images are averaged to limit memory

_ROWS_AT_ONCE = 256
# Smaller parts are not worth a thread, which takes half a millisecond to start if many threads run.
_LEAST_ROWS = 256
_LEAST_PARTS = 16_384

_LANES = 16  # words of a digest
_PART = 256  # words per digest
_block = wp.types.vector(length=_LANES, dtype=wp.uint32)


def masks(
    pixels: np.ndarray, is_srgb: bool = False, has_alpha: bool = True, is_premultiplied: bool = False
) -> np.ndarray:
    """Return (H, W, 1) float32 masks of (H, W, C) pixels: the mean of their colors times alpha."""
    return _reduced(pixels, 1, is_srgb, has_alpha, is_premultiplied)


def colors(
    pixels: np.ndarray, is_srgb: bool = False, has_alpha: bool = True, is_premultiplied: bool = False
) -> np.ndarray:
    """Return (H, W, 4) float32 of (H, W, C) pixels: linear colors multiplied by alpha, and alpha.

    is_srgb: pixels are encoded for display; has_alpha: the last of two or four channels is alpha, otherwise this
    channel is ignored; is_premultiplied: colors are already multiplied by alpha. Images larger than `MOST_SIDE` are
    averaged.
    """
    return _reduced(pixels, 4, is_srgb, has_alpha, is_premultiplied)


def convert_box(
    pixels: np.ndarray,
    box: tuple[slice, slice],
    found: np.ndarray,
    is_srgb: bool,
    has_alpha: bool,
    is_premultiplied: bool,
) -> None:
    """Convert a box of (H, W, C) float32 pixels into texels of `found`, an array of `colors` or `masks`.

    Sides of at most `MOST_SIDE`; box: slices of rows and columns.
    """
    _convert_into(found[box], pixels[box], is_srgb, has_alpha, is_premultiplied)


def changed_box(before: np.ndarray, now: np.ndarray) -> tuple[slice, slice] | None:
    """Return the slices of the rows and columns in which images (H, W, C) float32 differ; None if all bits agree."""
    floats = (np.ascontiguousarray(pixels, np.float32).reshape(len(pixels), -1) for pixels in (before, now))
    word = np.int64 if now.shape[2] % 2 == 0 else np.int32
    bits = [values.view(word) for values in floats]
    is_changed = bits[0] != bits[1]
    rows = np.flatnonzero(is_changed.any(axis=1))
    if not len(rows):
        return None
    changed = slice(int(rows[0]), int(rows[-1]) + 1)
    words_per_texel = now.shape[2] * 4 // np.dtype(word).itemsize
    texels = np.flatnonzero(is_changed[changed].any(axis=0)) // words_per_texel
    return changed, slice(int(texels[0]), int(texels[-1]) + 1)


def digests(pixels: np.ndarray) -> np.ndarray:
    """Return digests (N, 16) uint32 of the parts of an image (H, W, C) float32, to detect changes without a copy.

    A part has 256 consecutive words; the last part is filled up with zeros. Digests take half the time of a comparison
    with a copy, which is limited by memory bandwidth.
    """
    words = np.ascontiguousarray(pixels, np.float32).view(np.uint32).ravel()
    whole_count = len(words) // _PART
    found = np.empty((-(-len(words) // _PART), _LANES), np.uint32)
    parts = [(words[: whole_count * _PART], found[:whole_count])]
    if whole_count < len(found):
        parts.append((np.pad(words[whole_count * _PART :], (0, -len(words) % _PART)), found[whole_count:]))
    for some, out in parts:
        blocks = wp.array(some.reshape(-1, _PART // _LANES, _LANES), dtype=_block, device="cpu", copy=False)
        sums = wp.array(out, dtype=_block, device="cpu", copy=False)
        inputs = [parallel.Rows(blocks)]
        parallel.launch(_digest, len(out), inputs=inputs, outputs=[sums], device="cpu", least_rows=_LEAST_PARTS)
    return found


@wp.kernel
def _digest(
    parts: wp.array2d[_block],
    # outputs
    out_digests: wp.array[_block],
):
    """Evaluate a polynomial of each lane's words: a change of a single word always changes it."""
    part = wp.tid()
    blocks = parts[part]
    total = _block(wp.uint32(0))
    for place in range(blocks.shape[0]):
        words = blocks[place]
        # The upper half is mixed into the lower bits, as in `fingerprint`.
        total = wp.uint32(33) * total + words + wp.uint32(31) * (words / wp.uint32(65536))
    out_digests[part] = total


def box_of_changed_parts(
    before: np.ndarray, now: np.ndarray, shape: tuple[int, int, int]
) -> tuple[slice, slice] | None:
    """Return the slices of rows and columns of the parts of an image whose `digests` differ; None if all agree.

    shape: (H, W, C) of the image. The box contains all changes, and at most one more part on each side.
    """
    height, width, channels = shape
    words = np.flatnonzero(before.ravel().view(np.uint64) != now.ravel().view(np.uint64))
    is_changed = np.zeros(len(now), bool)
    is_changed[words // (_LANES // 2)] = True  # faster than a reduction along short rows
    changed = np.flatnonzero(is_changed)
    if not len(changed):
        return None
    in_row = width * channels
    first, last = changed * _PART, np.minimum((changed + 1) * _PART, height * in_row) - 1
    rows = slice(int(first[0]) // in_row, int(last[-1]) // in_row + 1)
    if (first // in_row != last // in_row).any():
        return rows, slice(0, width)
    return rows, slice(int((first % in_row).min()) // channels, int((last % in_row).max()) // channels + 1)


def unpremultiplied(means: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return colors (S, 3) and alpha (S,) in [0, 1] for means (S, 4) of `colors`; colors without alpha are black."""
    alpha = means[:, 3]
    if (alpha == 1.0).all():
        return means[:, :3], alpha
    with np.errstate(divide="ignore", invalid="ignore"):
        found = means[:, :3] / alpha[:, None]
    # A color with full alpha stays bit-identical.
    found = np.where(alpha[:, None] == 1.0, means[:, :3], np.where(alpha[:, None] > 0.0, found, 0.0))
    return np.where(np.isnan(alpha)[:, None], np.nan, found), np.clip(alpha, 0.0, 1.0)


def _reduced(pixels, channels, *way):
    """Return converted pixels, which are averaged by a power of two if a side exceeds `MOST_SIDE`."""
    height, width = pixels.shape[:2]
    step = 1
    while max(height, width) > step * MOST_SIDE:
        step *= 2
    if step == 1:
        return _converted(pixels, channels, *way)
    blocks = []
    rows = max(_ROWS_AT_ONCE // step, 1) * step
    for first in range(0, height, rows):
        block = _converted(pixels[first : first + rows], channels, *way)
        block = np.pad(block, ((0, -len(block) % step), (0, -width % step), (0, 0)), mode="edge")
        blocks.append(block.reshape(len(block) // step, step, block.shape[1] // step, step, -1).mean(axis=(1, 3)))
    return np.concatenate(blocks)


def _converted(pixels, channels, is_srgb, has_alpha, is_premultiplied):
    """Return premultiplied colors (H, W, 4), or masks (H, W, 1), of pixels (H, W, C)."""
    found = np.empty((*pixels.shape[:2], channels), np.float32)
    _convert_into(found, np.ascontiguousarray(pixels, np.float32), is_srgb, has_alpha, is_premultiplied)
    return found


def _convert_into(found, pixels, is_srgb, has_alpha, is_premultiplied):
    """Convert float32 pixels (H, W, C) to `found` (H, W, 1 or 4); both may be parts of larger arrays."""
    source, target = (wp.array(values, dtype=float, ndim=3, device="cpu", copy=False) for values in (pixels, found))
    bytes_ = wp.array(_linear_bytes(), dtype=float, device="cpu", copy=False)
    has_alpha = has_alpha and pixels.shape[2] in (2, 4)
    inputs = [parallel.Rows(source), bytes_, bool(is_srgb), has_alpha, has_alpha and not is_premultiplied]
    parallel.launch(_convert, len(pixels), inputs=inputs, outputs=[target], device="cpu", least_rows=_LEAST_ROWS)


@wp.kernel
def _convert(
    pixels: wp.array3d[float],
    linear_bytes: wp.array[float],
    is_srgb: bool,
    has_alpha: bool,
    is_straight: bool,
    # outputs
    out_pixels: wp.array3d[float],
):
    """Convert a row: non-finite and negative components become 0, and colors are multiplied by alpha if straight."""
    row = wp.tid()
    texels = pixels[row]
    found = out_pixels[row]
    last = texels.shape[1] - 1
    green_channel = 0
    blue_channel = 0
    if last >= 2:
        green_channel = 1
        blue_channel = 2
    for column in range(texels.shape[0]):
        red = _component(texels[column, 0], is_srgb, linear_bytes)
        green = _component(texels[column, green_channel], is_srgb, linear_bytes)
        blue = _component(texels[column, blue_channel], is_srgb, linear_bytes)
        alpha = float(1.0)
        if has_alpha:
            alpha = _within_one(texels[column, last])
        if is_straight:
            red *= alpha
            green *= alpha
            blue *= alpha
        if found.shape[1] == 4:
            found[column, 0] = red
            found[column, 1] = green
            found[column, 2] = blue
            found[column, 3] = alpha
        else:
            mean = (red + green + blue) / 3.0
            if red == green and red == blue:
                mean = red  # without rounding
            found[column, 0] = mean


@wp.func
def _component(value: float, is_srgb: bool, linear_bytes: wp.array[float]) -> float:
    """Return a linear component of a color."""
    if is_srgb:
        return linear_bytes[int(_within_one(value) * 255.0 + 0.5)]
    if not wp.isfinite(value):
        return 0.0
    return wp.max(value, 0.0)


@wp.func
def _within_one(value: float) -> float:
    if not wp.isfinite(value):
        return 0.0
    return wp.min(wp.max(value, 0.0), 1.0)


@cache
def _linear_bytes():
    """Return (256,) linear float32 values of 8-bit sRGB (IEC 61966-2-1)."""
    values = np.arange(256) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4).astype(np.float32)
