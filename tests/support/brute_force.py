# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances from triangle meshes by brute force: every point with every triangle."""

import numpy as np


def closest_points(points, corners):
    """Return (N, F, 3): the closest point of each triangle (F, 3, 3) to points (N, 3)."""
    a, b, c = (corners[None, :, k] for k in range(3))
    p = points[:, None]
    normal = np.cross(b - a, c - a)
    inside = p - normal * (dot(p - a, normal) / dot(normal, normal))[..., None]
    is_over = np.ones(inside.shape[:2], bool)
    best, least = None, None
    for start, end in ((a, b), (b, c), (c, a)):
        is_over &= dot(np.cross(end - start, inside - start), normal) >= 0.0
        along = np.clip(dot(p - start, end - start) / dot(end - start, end - start), 0.0, 1.0)
        on_edge = start + along[..., None] * (end - start)
        apart = dot(p - on_edge, p - on_edge)
        best = on_edge if best is None else np.where((apart < least)[..., None], on_edge, best)
        least = apart if least is None else np.minimum(apart, least)
    return np.where(is_over[..., None], inside, best)


def distances(points, mesh):
    """Return the unsigned distances (N,) float64 [m] of points (N, 3) from a mesh."""
    points = points.astype(np.float64)
    apart = np.linalg.norm(closest_points(points, mesh.corners) - points[:, None], axis=2)
    return apart.min(axis=1)


def is_inside(points, mesh):
    """Return (N,) bool: whether points are inside a closed mesh, by the solid angles of its triangles [Oosterom83]."""
    a, b, c = np.moveaxis(mesh.corners[None] - points[:, None, None].astype(np.float64), 2, 0)
    la, lb, lc = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
    below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    return np.arctan2(dot(a, np.cross(b, c)), below).sum(axis=1) > np.pi


def dot(a, b):
    return np.einsum("...i,...i->...", a, b)
