# SPDX-License-Identifier: GPL-3.0-or-later
"""Combed guides: polylines of many shapes, with roots on a surface or anywhere."""

import numpy as np

from hair_addon.core.geometry import sampling
from hair_addon.core.geometry.mesh import normals, positions


def wavy(rng, count=30, point_count=17):
    """Return (S, P, 3) float32: strands that bend and twist at random, of segments of different lengths."""
    turns = np.cumsum(rng.normal(0.0, 0.25, (count, point_count - 1, 3)), axis=1)
    directions = rng.normal(size=(count, 1, 3)) + turns
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    steps = directions * rng.uniform(0.005, 0.02, (count, point_count - 1, 1))
    roots = rng.normal(0.0, 0.3, (count, 1, 3))
    return np.concatenate([roots, roots + np.cumsum(steps, axis=1)], axis=1).astype(np.float32)


def standing(mesh, count, rng, length=0.3, point_count=21, spread=0.4):
    """Return bent strands that grow from a mesh: (S, P, 3) float32 points, `SurfacePoints` and normals (S, 3)."""
    roots = sampling.sample_surface(mesh, count, 3)
    up = normals(mesh, roots).astype(np.float64)
    side = np.cross(up, rng.normal(size=(count, 3)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    s = np.linspace(0.0, 1.0, point_count)[None, :, None]
    points = positions(mesh, roots)[:, None] + length * (s * up[:, None] + spread * s**2 * side[:, None])
    return points.astype(np.float32), roots, up.astype(np.float32)


def segment_lengths(points):
    """Return (S, P-1) float64 lengths of segments."""
    return np.linalg.norm(np.diff(np.asarray(points, np.float64), axis=1), axis=2)


def lengths(points):
    """Return (S,) float64 lengths of strands."""
    return segment_lengths(points).sum(axis=1)


def distance_to_polylines(places, points):
    """Return (S, Q) float64 distances of positions (S, Q, 3) from polylines (S, P, 3), by brute force."""
    places, points = np.asarray(places, np.float64)[:, :, None], np.asarray(points, np.float64)[:, None]
    start, step = points[:, :, :-1], np.diff(points, axis=2)
    share = np.sum((places - start) * step, axis=3) / np.maximum(np.sum(step * step, axis=3), 1e-30)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * step
    return np.linalg.norm(places - nearest, axis=3).min(axis=2)
