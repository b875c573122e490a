# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths of guides: scaled, set, or limited. Guides are shortened by cutting along their curve, or by scaling."""

import numpy as np

from ..geometry.strands import lengths as lengths_of
from .guide_tool_settings import LengthSettings

_ROUNDS = 24  # of the search for the cut; the interval at least halves every second round
_CLOSE = 1e-7  # tolerance relative to a guide's length


def resized(points: np.ndarray, settings: LengthSettings, weights: np.ndarray) -> np.ndarray:
    """Return guides (S, P, 3) float32 [m] with the lengths of `LengthSettings` and unchanged roots.

    points (S, P, 3) [m]; weights (S,) in [0, 1]: fraction of the change. Guides of zero length, and guides with the
    wanted length, are bit-identical.
    """
    present = lengths_of(np.asarray(points, np.float64))
    wanted = {
        "SCALE": settings.factor * present,
        "SET": np.full(len(points), settings.length),
        "MINIMUM": np.maximum(present, settings.length),
        "MAXIMUM": np.minimum(present, settings.length),
    }[settings.method]
    wanted = present + weights * (wanted - present)
    out = np.array(points, np.float32)
    is_cut = (wanted < present) & (settings.shorten == "CUT")
    out[is_cut] = cut_to_length(points[is_cut], wanted[is_cut])
    is_scaled = (wanted != present) & ~is_cut & (present > 0.0)
    out[is_scaled] = _scaled(points[is_scaled], (wanted / np.where(present > 0.0, present, 1.0))[is_scaled])
    return out


def _scaled(points, factors):
    """Return strands (S, P, 3) float32 scaled about their roots by factors (S,)."""
    roots = points[:, :1].astype(np.float64)
    scaled = (roots + factors[:, None, None] * (points - roots)).astype(np.float32)
    scaled[:, 0] = points[:, 0]
    return scaled


def cut(points: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return guides (S, P, 3) float32 [m] cut at given lengths, with as many points as before, all on the original.

    points (S, P, 3) [m]; ends (S,) [m]: arc length of each cut, at most the guide's length. Points keep their fractions
    of the length: a guide that is cut at its tip is unchanged.
    """
    points = np.asarray(points, np.float64)
    steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
    along = np.concatenate([np.zeros((len(points), 1)), np.cumsum(steps, axis=1)], axis=1)
    lengths = along[:, -1:]
    wanted = along * np.minimum(ends[:, None] / np.where(lengths > 0.0, lengths, 1.0), 1.0)
    last = points.shape[1] - 2
    # Brute force: P comparisons for each point are few.
    segment = np.clip((along[:, None, :] <= wanted[:, :, None]).sum(axis=2) - 1, 0, last)
    start, span = (np.take_along_axis(array, segment, axis=1) for array in (along, steps))
    share = np.clip((wanted - start) / np.where(span > 0.0, span, 1.0), 0.0, 1.0)[..., None]
    before, after = (np.take_along_axis(points, place[..., None], axis=1) for place in (segment, segment + 1))
    shortened = ((1.0 - share) * before + share * after).astype(np.float32)
    shortened[:, 0] = points[:, 0]
    return shortened


def cut_to_length(points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return guides (S, P, 3) float32 [m] cut so that the results have the wanted lengths (S,) [m].

    The resampled polyline is shorter than the original up to the cut, so the cut lies slightly beyond `wanted`. The cut
    is found by false position with the Illinois rule, between `wanted` and the tip.
    """
    if not len(points):
        return np.asarray(points, np.float32)
    full = lengths_of(np.asarray(points, np.float64))
    ends = wanted.astype(np.float64)
    low, high = ends.copy(), full.copy()
    low_error, high_error = _cut_length(points, low) - wanted, full - wanted
    side = np.zeros(len(points))
    left = np.flatnonzero(np.abs(low_error) > _CLOSE * full)
    for _ in range(_ROUNDS):
        if not len(left):
            break
        slope = high_error[left] - low_error[left]
        step = high_error[left] * (high[left] - low[left]) / np.where(slope > 0.0, slope, 1.0)
        ends[left] = np.where(slope > 0.0, high[left] - step, low[left])
        error = _cut_length(points[left], ends[left]) - wanted[left]
        is_low = error < 0.0
        # Illinois rule: halve the error of an end that is retained twice in a row.
        high_error[left] *= np.where(is_low & (side[left] < 0), 0.5, 1.0)
        low_error[left] *= np.where(~is_low & (side[left] > 0), 0.5, 1.0)
        low[left], low_error[left] = np.where(is_low, (ends[left], error), (low[left], low_error[left]))
        high[left], high_error[left] = np.where(is_low, (high[left], high_error[left]), (ends[left], error))
        side[left] = np.where(is_low, -1.0, 1.0)
        left = left[np.abs(error) > _CLOSE * full[left]]
    return cut(points, ends)


def _cut_length(points, ends):
    return lengths_of(cut(points, ends).astype(np.float64))
