# SPDX-License-Identifier: GPL-3.0-or-later
"""Resampling of curves by curvature, and rotation-minimizing frames along them."""

import numpy as np

_TINY = 1e-12


def unit(vectors: np.ndarray, otherwise: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> np.ndarray:
    """Return normalized vectors (..., 3); `otherwise` replaces vectors of zero length."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(lengths > _TINY, vectors / np.maximum(lengths, _TINY), otherwise)


def perpendicular(vectors: np.ndarray) -> np.ndarray:
    """Return unit vectors (..., 3) perpendicular to unit vectors (..., 3)."""
    smallest = np.argmin(np.abs(vectors), axis=-1)
    return unit(np.cross(vectors, np.eye(3)[smallest]))


def resample_by_curvature(curves: np.ndarray, point_count: int) -> np.ndarray:
    """Return curves (C, P, 3) resampled to (C, point_count, 3) float64, with points closer together in bends.

    A turn by 180° weighs as much as the whole length. The ends do not move.
    """
    curves = np.asarray(curves, np.float64)
    edges = np.diff(curves, axis=1)
    lengths = np.linalg.norm(edges, axis=-1)
    directions = unit(edges)
    turns = np.zeros(lengths.shape)
    if edges.shape[1] > 1:
        cosines = np.einsum("cpi,cpi->cp", directions[:, 1:], directions[:, :-1])
        angles = np.arccos(np.clip(cosines, -1.0, 1.0))
        turns[:, 1:] += 0.5 * angles  # the angle between two edges is divided between them
        turns[:, :-1] += 0.5 * angles
    share = lengths / np.maximum(lengths.sum(axis=1, keepdims=True), _TINY)
    steps = np.where(lengths > 0.0, share + turns / np.pi, 0.0)
    places = np.concatenate([np.zeros((len(curves), 1)), np.cumsum(steps, axis=1)], axis=1)
    indices, found = np.arange(curves.shape[1]), np.empty((len(curves), point_count, 3))
    for curve, (place, points) in enumerate(zip(places, curves, strict=True)):
        at = np.interp(np.linspace(0.0, place[-1], point_count), place, indices)
        low = np.minimum(at.astype(int), len(points) - 2)
        found[curve] = points[low] + (at - low)[:, None] * (points[low + 1] - points[low])
    found[:, [0, -1]] = curves[:, [0, -1]]
    return found


def tangents(curves: np.ndarray) -> np.ndarray:
    """Return unit tangents (C, P, 3); at inner points, the mean direction of the two edges."""
    directions = unit(np.diff(curves, axis=1))
    inner = unit(directions[:, 1:] + directions[:, :-1])
    return np.concatenate([directions[:, :1], inner, directions[:, -1:]], axis=1)


def steady_normals(curves: np.ndarray, first: np.ndarray | None = None) -> np.ndarray:
    """Return rotation-minimizing unit normals (C, P, 3), by double reflection [Wang08].

    first: (C, 3) unit normals at the first point, perpendicular to the tangents; None for arbitrary ones.
    """
    along = tangents(curves)
    normals = np.empty(curves.shape)
    normals[:, 0] = perpendicular(along[:, 0]) if first is None else first
    for point in range(curves.shape[1] - 1):
        edge = curves[:, point + 1] - curves[:, point]
        reflected = _reflected(normals[:, point], edge)
        tangent = _reflected(along[:, point], edge)
        moved = _reflected(reflected, along[:, point + 1] - tangent)
        across = moved - along[:, point + 1] * np.einsum("ci,ci->c", moved, along[:, point + 1])[:, None]
        normals[:, point + 1] = unit(across)
    return normals


def _reflected(vectors, axes):
    """Return vectors (C, 3) reflected in planes perpendicular to axes (C, 3); unchanged for axes of zero length."""
    squares = np.maximum(np.einsum("ci,ci->c", axes, axes), _TINY**2)
    return vectors - (2.0 * np.einsum("ci,ci->c", axes, vectors) / squares)[:, None] * axes
