# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoothing of guides along their length: directions of segments diffuse; roots and lengths are preserved."""

import numpy as np

from .guide_segments import joined, only, split, unit
from .guide_tool_settings import SmoothSettings


def smoothed(points: np.ndarray, settings: SmoothSettings, weights: np.ndarray) -> np.ndarray:
    """Return smoothed guides (S, P, 3) float32 [m]; segments keep their lengths, straight guides are unchanged.

    points (S, P, 3) [m]; weights (S,) in [0, 1]. Each step moves a direction toward the mean of its neighbors; the
    first and the last direction are their own second neighbors.
    """
    directions, lengths = split(points)
    if directions.shape[1] < 2:
        return np.array(points, np.float32)
    share = (0.5 * settings.strength * weights)[:, None, None]
    for _ in range(settings.iterations):
        before = np.concatenate([directions[:, :1], directions[:, :-1]], axis=1)
        after = np.concatenate([directions[:, 1:], directions[:, -1:]], axis=1)
        moved = unit(directions + share * (0.5 * (before + after) - directions))
        directions = np.where(moved.any(axis=2, keepdims=True), moved, directions)
    return only(points, joined(points, directions, lengths), weights)
