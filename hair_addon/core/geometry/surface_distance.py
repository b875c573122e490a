# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances along a mesh from some of its points, and the directions in which distances grow.

Distances spread over triangles as from a virtual source in the plane of each triangle, as in [Kimmel98], until no
distance changes: exact on planes, within a few percent on curved surfaces.
"""

import numpy as np

from .mesh import SurfacePoints, TriMesh, interpolate, positions

_MOST_ROUNDS = 10_000
_CLOSE = 1e-6  # relative change of a distance that ends the spread


def source_distances(mesh: TriMesh, points: SurfacePoints) -> np.ndarray:
    """Return (V,) float64 [m]: distances of the corners of triangles with source points; infinite elsewhere."""
    found = np.full(len(mesh.vertices), np.inf)
    corners = mesh.triangles[points.triangle]
    apart = np.linalg.norm(mesh.vertices[corners] - positions(mesh, points)[:, None], axis=2)
    np.minimum.at(found, corners.ravel(), apart.astype(np.float64).ravel())
    return found


def spread(mesh: TriMesh, sources: np.ndarray) -> np.ndarray:
    """Return (V,) float64 [m]: distances along the mesh; infinite on parts without a source.

    sources: (V,) distances at the sources, which may become smaller; infinite elsewhere.
    """
    found = np.array(sources, np.float64)
    # Each triangle three times: its last vertex is reached from the first two.
    turns = np.concatenate([np.roll(mesh.triangles, turn, axis=1) for turn in range(3)]).astype(np.int64)
    first, second, third = (mesh.vertices[turns[:, corner]].astype(np.float64) for corner in range(3))
    base = np.linalg.norm(second - first, axis=1)
    sides = np.linalg.norm(third - first, axis=1), np.linalg.norm(third - second, axis=1)
    length = np.where(base > 0.0, base, 1.0)
    along = np.einsum("ij,ij->i", third - first, second - first) / length
    height = np.sqrt(np.maximum(sides[0] ** 2 - along**2, 0.0))
    is_changed = np.isfinite(found)
    for _round in range(_MOST_ROUNDS):
        rows = np.flatnonzero(is_changed[turns[:, 0]] | is_changed[turns[:, 1]])
        if not len(rows):
            break
        here, there = found[turns[rows, 0]], found[turns[rows, 1]]
        reached = np.minimum(here + sides[0][rows], there + sides[1][rows])
        is_known = np.isfinite(here) & np.isfinite(there) & (base[rows] > 0.0)
        some = rows[is_known]
        a, b = here[is_known], there[is_known]
        x = (a * a + length[some] ** 2 - b * b) / (2.0 * length[some])
        y = np.sqrt(np.maximum(a * a - x * x, 0.0))
        crossing = x + (along[some] - x) * y / np.maximum(y + height[some], 1e-30)
        is_through = (crossing >= 0.0) & (crossing <= length[some]) & (a * a >= x * x)
        straight = np.hypot(along[some] - x, height[some] + y)
        reached[is_known] = np.where(is_through, np.minimum(straight, reached[is_known]), reached[is_known])
        before = found.copy()
        np.minimum.at(found, turns[rows, 2], reached)
        is_changed = found < before * (1.0 - _CLOSE)
    return found


def directions(mesh: TriMesh, distances: np.ndarray) -> np.ndarray:
    """Return (V, 3) float64 unit directions in which distances (V,) grow, zero where they are unknown."""
    corners = mesh.vertices[mesh.triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.maximum(np.einsum("ij,ij->i", normals, normals), 1e-300)
    values = np.where(np.isfinite(distances), distances, 0.0)[mesh.triangles]
    is_known = np.isfinite(distances)[mesh.triangles].all(axis=1)
    gradients = np.zeros((len(corners), 3))
    for corner in range(3):
        edge = corners[:, (corner + 2) % 3] - corners[:, (corner + 1) % 3]
        gradients += values[:, corner, None] * np.cross(normals, edge) / twice[:, None]
    weighted = np.where(is_known[:, None], gradients * np.sqrt(twice)[:, None], 0.0)
    found = np.zeros((len(mesh.vertices), 3))
    for corner in range(3):
        np.add.at(found, mesh.triangles[:, corner], weighted)
    sizes = np.linalg.norm(found, axis=1, keepdims=True)
    return found / np.where(sizes > 0.0, sizes, 1.0)


def at(values: np.ndarray, mesh: TriMesh, points: SurfacePoints) -> np.ndarray:
    """Return values (V,) of vertices at surface points (N,); infinite in triangles with an infinite value."""
    is_known = np.isfinite(values)
    found = interpolate(np.where(is_known, values, 0.0).astype(np.float32), mesh, points).astype(np.float64)
    found[~is_known[mesh.triangles[points.triangle]].all(axis=1)] = np.inf
    return found
