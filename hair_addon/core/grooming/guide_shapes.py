# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoothing of guides along their length: directions of segments diffuse; roots and lengths are preserved."""

import numpy as np

from .guide_tool_settings import LiftSettings, SmoothSettings


def split(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit directions (S, P-1, 3), zero for zero length, and lengths (S, P-1) [m] of points (S, P, 3) [m]."""
    steps = np.diff(np.asarray(points, np.float64), axis=1)
    lengths = np.linalg.norm(steps, axis=2)
    return steps / np.where(lengths > 0.0, lengths, 1.0)[..., None], lengths


def joined(points: np.ndarray, directions: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return strands (S, P, 3) float32 [m] with the roots of `points` and segments as from `split`."""
    roots = np.asarray(points[:, :1], np.float64)
    tail = roots + np.cumsum(directions * lengths[..., None], axis=1)
    return np.concatenate([points[:, :1], tail.astype(np.float32)], axis=1)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) normalized; zero vectors stay zero."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0.0, lengths, 1.0)


def across(vectors: np.ndarray) -> np.ndarray:
    """Return a unit vector perpendicular to each unit vector (..., 3)."""
    return unit(np.cross(vectors, np.eye(3)[np.abs(vectors).argmin(axis=-1)]))


def turned(directions: np.ndarray, targets: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return unit vectors (..., 3) rotated toward others by fractions (...) in [0, 1] of the angle between them.

    A direction opposite to its target turns about an arbitrary perpendicular axis. Zero vectors, and directions with a
    zero target, are unchanged.
    """
    cosine = np.clip(np.sum(directions * targets, axis=-1), -1.0, 1.0)
    aside = targets - cosine[..., None] * directions
    sine = np.linalg.norm(aside, axis=-1)
    is_opposite = (sine < 1e-9) & (cosine < 0.0)
    aside = np.where(is_opposite[..., None], across(directions), aside / np.maximum(sine, 1e-300)[..., None])
    # Angles below the rounding of single precision are ignored.
    has_angle = ((sine >= 1e-9) | is_opposite) & directions.any(axis=-1) & targets.any(axis=-1)
    angle = np.where(has_angle, shares * np.arctan2(sine, cosine), 0.0)[..., None]
    return np.where(angle == 0.0, directions, np.cos(angle) * directions + np.sin(angle) * aside)


def rotations(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the least rotations (N, 3, 3) that map unit vectors (N, 3) to other unit vectors."""
    axis, cosine = np.cross(start, end), np.sum(start * end, axis=1)
    cross = np.zeros((len(start), 3, 3))
    for row, column, part, sign in ((0, 1, 2, -1), (0, 2, 1, 1), (1, 2, 0, -1)):
        cross[:, row, column], cross[:, column, row] = sign * axis[:, part], -sign * axis[:, part]
    found = np.eye(3) + cross + cross @ cross / np.maximum(1.0 + cosine, 1e-12)[:, None, None]
    half_turn = across(start)
    flipped = 2.0 * half_turn[:, :, None] * half_turn[:, None, :] - np.eye(3)
    return np.where((cosine < -1.0 + 1e-9)[:, None, None], flipped, found)


def blended(points: np.ndarray, others: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return strands (S, P, 3) float32 [m] blended with others (S, P, 3) [m] by weights (S,) in [0, 1].

    Directions of segments are interpolated by angle, lengths linearly. Roots do not move.
    """
    (mine, my_lengths), (theirs, their_lengths) = split(points), split(others)
    # A segment of zero length takes the other's direction.
    mine, theirs = (
        np.where(one.any(axis=2, keepdims=True), one, other) for one, other in ((mine, theirs), (theirs, mine))
    )
    share = np.asarray(weights, np.float64)[:, None]
    return joined(points, turned(mine, theirs, share), my_lengths + share * (their_lengths - my_lengths))


def only(points: np.ndarray, changed: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return (S, P, 3) float32: changed strands where weights (S,) are positive, else bit-identical points."""
    return np.where((np.asarray(weights) > 0.0)[:, None, None], changed, points).astype(np.float32)


def arc_shares(lengths: np.ndarray) -> np.ndarray:
    """Return the normalized arc length (S, P-1) of each segment's midpoint, in [0, 1]; lengths (S, P-1) [m]."""
    ends = np.cumsum(lengths, axis=1)
    return (ends - 0.5 * lengths) / np.where(ends[:, -1:] > 0.0, ends[:, -1:], 1.0)


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
