# SPDX-License-Identifier: GPL-3.0-or-later
"""Lifting of guides: segments turn toward the root's normal, most near the root, with constant lengths."""

import numpy as np

from .guide_segments import arc_shares, joined, only, split, turned
from .guide_tool_settings import LiftSettings


def lifted(points: np.ndarray, normals: np.ndarray, settings: LiftSettings, weights: np.ndarray) -> np.ndarray:
    """Return lifted guides (S, P, 3) float32 [m]; segments keep their lengths.

    points (S, P, 3) [m]; normals (S, 3): unit, at the roots; weights (S,) in [0, 1].
    """
    directions, lengths = split(points)
    with np.errstate(over="ignore"):  # for the smallest reach
        fade = np.clip(1.0 - arc_shares(lengths) / settings.reach, 0.0, 1.0)
    # Smoothstep: guides bend without a kink.
    shares = settings.amount * np.asarray(weights, np.float64)[:, None] * fade * fade * (3.0 - 2.0 * fade)
    upward = np.broadcast_to(np.asarray(normals, np.float64)[:, None], directions.shape)
    return only(points, joined(points, turned(directions, upward, shares), lengths), weights)
