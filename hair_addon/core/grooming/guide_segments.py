# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides as directions and lengths of their segments: what tools turn and scale, so that roots do not move.

All arrays are float64 here, so that segments keep their lengths to the rounding of single precision.
"""

import numpy as np


def split(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(S, P, 3) [m] → unit directions (S, P-1, 3) and lengths (S, P-1) [m]; a segment without length points nowhere."""
    steps = np.diff(np.asarray(points, np.float64), axis=1)
    lengths = np.linalg.norm(steps, axis=2)
    return steps / np.where(lengths > 0.0, lengths, 1.0)[..., None], lengths


def joined(points: np.ndarray, directions: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """(S, P, 3) float32 [m]: strands from the roots of `points`, of segments as `split` gives them."""
    roots = np.asarray(points[:, :1], np.float64)
    tail = roots + np.cumsum(directions * lengths[..., None], axis=1)
    return np.concatenate([points[:, :1], tail.astype(np.float32)], axis=1)


def unit(vectors: np.ndarray) -> np.ndarray:
    """(..., 3) made unit; zero stays zero."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0.0, lengths, 1.0)


def across(vectors: np.ndarray) -> np.ndarray:
    """(..., 3): a unit vector at right angles to each unit vector."""
    return unit(np.cross(vectors, np.eye(3)[np.abs(vectors).argmin(axis=-1)]))


def turned(directions: np.ndarray, targets: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Unit (..., 3) turned toward other unit vectors by shares (...) of the angle between them, in [0, 1].

    A direction that is opposite to its target turns about an axis across it. Zero stays zero, and turns no other.
    """
    cosine = np.clip(np.sum(directions * targets, axis=-1), -1.0, 1.0)
    aside = targets - cosine[..., None] * directions
    sine = np.linalg.norm(aside, axis=-1)
    is_opposite = (sine < 1e-9) & (cosine < 0.0)
    aside = np.where(is_opposite[..., None], across(directions), aside / np.maximum(sine, 1e-300)[..., None])
    # Below the rounding of single precision there is nothing to turn.
    has_angle = ((sine >= 1e-9) | is_opposite) & directions.any(axis=-1) & targets.any(axis=-1)
    angle = np.where(has_angle, shares * np.arctan2(sine, cosine), 0.0)[..., None]
    return np.where(angle == 0.0, directions, np.cos(angle) * directions + np.sin(angle) * aside)


def rotations(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(N, 3, 3): the least rotations that take unit vectors (N, 3) to others."""
    axis, cosine = np.cross(start, end), np.sum(start * end, axis=1)
    cross = np.zeros((len(start), 3, 3))
    for row, column, part, sign in ((0, 1, 2, -1), (0, 2, 1, 1), (1, 2, 0, -1)):
        cross[:, row, column], cross[:, column, row] = sign * axis[:, part], -sign * axis[:, part]
    found = np.eye(3) + cross + cross @ cross / np.maximum(1.0 + cosine, 1e-12)[:, None, None]
    half_turn = across(start)
    flipped = 2.0 * half_turn[:, :, None] * half_turn[:, None, :] - np.eye(3)
    return np.where((cosine < -1.0 + 1e-9)[:, None, None], flipped, found)


def blended(points: np.ndarray, others: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(S, P, 3) float32 [m]: strands part of the way to others (S, P, 3) [m]; weights (S,) in [0, 1].

    Each segment turns toward the other's by this share of the angle, and takes this share of its length. Roots stay.
    """
    (mine, my_lengths), (theirs, their_lengths) = split(points), split(others)
    # A segment without length takes the other's direction, so that it can grow.
    mine, theirs = (
        np.where(one.any(axis=2, keepdims=True), one, other) for one, other in ((mine, theirs), (theirs, mine))
    )
    share = np.asarray(weights, np.float64)[:, None]
    return joined(points, turned(mine, theirs, share), my_lengths + share * (their_lengths - my_lengths))


def only(points: np.ndarray, changed: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(S, P, 3) float32: changed strands where weights (S,) are above zero, the others to the last bit as they were."""
    return np.where((np.asarray(weights) > 0.0)[:, None, None], changed, points).astype(np.float32)


def arc_shares(lengths: np.ndarray) -> np.ndarray:
    """(S, P-1) in [0, 1]: where the middle of each segment is along its strand; lengths (S, P-1) [m]."""
    ends = np.cumsum(lengths, axis=1)
    return (ends - 0.5 * lengths) / np.where(ends[:, -1:] > 0.0, ends[:, -1:], 1.0)
