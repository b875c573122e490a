# SPDX-License-Identifier: GPL-3.0-or-later
"""Values of a map at strands, combined with the value of a setting."""

from dataclasses import dataclass

import numpy as np

from ..params import Param
from ..styling.random_numbers import random_numbers

_PURPOSE = 512  # different from all purposes of styles


@dataclass(frozen=True)
class Combination:
    """How a map changes a setting: numbers are multiplied by low to high, colors are mixed by an amount."""

    low: float = 0.0
    high: float = 1.0
    is_inverted: bool = False
    amount: float = 1.0


def varied_number(value: float, mask: np.ndarray, how: Combination, details: Param) -> np.ndarray:
    """Return value × lerp(low, high, mask) (S,) float64 for masks (S,), within the range of the setting.

    Infinite masks count as 0; NaN, a strand without a map, keeps the value.
    """
    return within(value * factors(mask, how), details)


def factors(mask: np.ndarray, how: Combination) -> np.ndarray:
    """Return lerp(low, high, mask) (S,) float64 for masks (S,): infinite masks count as 0, NaN gives the factor 1."""
    mask = np.where(np.isinf(mask), 0.0, np.asarray(mask, float))
    if how.is_inverted:
        mask = 1.0 - mask
    factor = (1.0 - mask) * how.low + mask * how.high
    return np.where(np.isnan(factor), 1.0, factor)


def within(values: np.ndarray, details: Param) -> np.ndarray:
    """Return values (S,) of a setting limited to its range."""
    least = details.low if details.above == -np.inf else max(details.low, np.nextafter(details.above, np.inf))
    return np.clip(values, least, details.high)


def varied_color(value: tuple, colors: np.ndarray, alpha: np.ndarray, how: Combination, details: Param) -> np.ndarray:
    """Return mix(value, color, amount × alpha) (S, 3) float64 for colors (S, 3) and alpha (S,), within the range.

    Infinite colors count as 0; NaN, a strand without a map, keeps the value.
    """
    colors = np.asarray(colors, float)
    is_infinite = np.isinf(colors)
    if is_infinite.any():
        colors = np.where(is_infinite, 0.0, colors)
    if how.is_inverted:
        colors = 1.0 - colors
    share = (how.amount * np.asarray(alpha, float))[:, None]
    if (share == 1.0).all() and np.isfinite(colors).all():
        return np.clip(colors, details.low, details.high)
    mixed = np.where(share == 1.0, colors, (1.0 - share) * np.asarray(value, float) + share * colors)
    is_known = np.isfinite(colors[:, :1] + colors[:, 1:2] + colors[:, 2:]) & np.isfinite(share)
    return np.clip(np.where(is_known, mixed, np.asarray(value, float)), details.low, details.high)


def ramped(masks: np.ndarray, ramp: np.ndarray, is_inverted: bool) -> np.ndarray:
    """Return the values (S, C) float32 of a ramp at masks (S,) of strands.

    ramp: (N, C) values at N evenly spaced positions from 0 to 1; is_inverted: whether masks are inverted first.
    Infinite masks count as 0; NaN, a strand without a map, stays NaN.
    """
    masks = np.asarray(masks, np.float32)
    known = np.where(np.isfinite(masks), masks, np.float32(0.0))
    places = np.clip(1.0 - known if is_inverted else known, 0.0, 1.0) * np.float32(len(ramp) - 1)
    below = places.astype(np.int32)
    share = (places - below)[:, None]
    found, above = ramp[below], ramp[np.minimum(below + 1, len(ramp) - 1)]
    # This form is exact at samples, and between equal samples.
    found = found + share * (above - found)
    found[np.isnan(masks)] = np.nan
    return found


def random_masks(identities: np.ndarray, seed: int) -> np.ndarray:
    """Return random numbers (S,) float32 in [0, 1) for IDs (S,) int32 of strands or clumps; equal for equal IDs."""
    return random_numbers(np.asarray(identities).astype(np.int32), seed, _PURPOSE)
