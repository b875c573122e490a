# SPDX-License-Identifier: GPL-3.0-or-later
"""Orientation of the closed and open parts of a triangle mesh, and its rims."""

import numpy as np

from ...geometry.closest_point import SurfaceQuery
from ...geometry.faces.connected_components import connected_components
from ...geometry.mesh import TriMesh

_MOST_SAMPLES = 16  # most vertices of a part that are tested for being inside another part


def outward(mesh: TriMesh) -> np.ndarray:
    """Return the triangles (F, 3) int32; closed parts are wound counter-clockwise as seen from outside.

    A closed part of negative volume is flipped, unless it is inside another closed part and thus bounds a cavity.
    """
    triangles = mesh.checked_triangles.copy()
    parts = connected_components(mesh)
    is_closed = _is_closed(welded(mesh), parts)
    centred = mesh.corners - mesh.corners.reshape(-1, 3).mean(axis=0)
    volumes = np.bincount(parts, np.linalg.det(centred) / 6.0)  # of tetrahedra with an apex at the center
    for part in np.flatnonzero(is_closed & (volumes < 0.0)):
        others = [other for other in np.flatnonzero(is_closed) if other != part]
        if not any(_is_inside(mesh, parts == part, parts == other) for other in others):
            turned = np.flatnonzero(parts == part)
            triangles[turned] = triangles[turned][:, [0, 2, 1]]
    return triangles


def open_parts(mesh: TriMesh) -> np.ndarray:
    """Return the index (F,) int32 of each triangle's connected part; -1 for closed parts, whose outside is known."""
    parts = connected_components(mesh)
    return np.where(_is_closed(welded(mesh), parts)[parts], -1, parts).astype(np.int32)


def facing_hair(mesh: TriMesh, parts: np.ndarray, corners: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) int32; open parts are flipped if their hair is behind them on average.

    parts: from `open_parts`; corners: (S, 3) vertices around the root of each strand; ways: (S, 3) directions of
    strands at their roots.
    """
    triangles = mesh.checked_triangles
    part_of = np.full(len(mesh.vertices), -1, np.int32)
    part_of[triangles] = parts[:, None]
    part_of_strand = part_of[corners[:, 0]]
    is_on = part_of_strand >= 0
    if not is_on.any():
        return triangles
    first, second, third = np.moveaxis(mesh.vertices[triangles].astype(np.float64), 1, 0)
    normals = np.zeros((len(mesh.vertices), 3))
    np.add.at(normals, triangles, np.cross(second - first, third - first)[:, None])
    at_roots = _unit(normals)[corners[is_on]].mean(axis=1)
    sines = np.einsum("si,si->s", at_roots, _unit(ways[is_on].astype(np.float64)))
    is_behind = np.bincount(part_of_strand[is_on], sines, minlength=parts.max() + 1) < 0.0
    is_turned = (parts >= 0) & is_behind[parts]
    return np.where(is_turned[:, None], triangles[:, [0, 2, 1]], triangles)


def facing_strands(mesh: TriMesh, roots: np.ndarray, seconds: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) int32; open parts are wound so that strands are in front of them on average.

    roots, seconds: (S, 3) [m] the first two points of each strand.
    """
    parts = open_parts(mesh)
    if (parts < 0).all():
        return mesh.triangles
    nearest = SurfaceQuery(mesh).nearest(roots)
    return facing_hair(mesh, parts, mesh.triangles[nearest.triangle], seconds - roots)


def _unit(vectors):
    """Return normalized vectors (N, 3); zero vectors stay zero."""
    sizes = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, sizes, out=np.zeros_like(vectors), where=sizes > 0.0)


def rims(mesh: TriMesh) -> np.ndarray:
    """Return rim bits (F,) int32 of triangles.

    Bit k: no other triangle shares the edge opposite corner k. Bit 3 + k: corner k is on such an edge.
    """
    triangles = welded(mesh)
    edges = np.sort(np.stack([np.roll(triangles, -1 - k, axis=1)[:, :2] for k in range(3)], axis=1), axis=2)
    of_edge, counts = _edge_kinds(edges.reshape(-1, 2))
    is_rim = (counts == 1)[of_edge.reshape(-1, 3)]
    is_on_rim = np.zeros(len(mesh.vertices), bool)
    is_on_rim[edges[is_rim].ravel()] = True
    bits = np.concatenate([is_rim, is_on_rim[triangles]], axis=1)
    return (bits << np.arange(6)).sum(axis=1).astype(np.int32)


def welded(mesh: TriMesh) -> np.ndarray:
    """Return the triangles (F, 3) of a mesh with coincident vertices merged, so that seams are not rims."""
    order = np.lexsort(mesh.vertices.T)
    ordered = mesh.vertices[order]
    is_new = np.ones(len(order), bool)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    first = np.empty(len(order), np.int64)
    first[order] = order[is_new][np.cumsum(is_new) - 1]
    return first[mesh.checked_triangles]


def _edge_kinds(edges):
    """Return (index of the unique edge of each edge (N, 2), number of occurrences of each unique edge).

    Sorting edges as single numbers takes a fifth of the time of sorting rows.
    """
    _, kinds, counts = np.unique(
        edges[:, 0].astype(np.int64) << 32 | edges[:, 1], return_inverse=True, return_counts=True
    )
    return kinds.reshape(-1), counts


def _is_closed(triangles, parts):
    """Return (parts,) bool: whether two triangles with opposite directions share each edge of a part."""
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    ahead = directed[:, 0] < directed[:, 1]
    of_edge, counts = _edge_kinds(np.sort(directed, axis=1))
    balance = np.bincount(of_edge, np.where(ahead, 1, -1), minlength=len(counts))
    is_open = ((counts != 2) | (balance != 0))[of_edge]
    return np.bincount(np.tile(parts, 3), is_open) == 0


def _is_inside(mesh, inner, outer):
    """Return whether the triangles `inner` are inside the closed part of triangles `outer`, by winding numbers."""
    points, shell = mesh.corners[inner].reshape(-1, 3), mesh.corners[outer]
    low, high = shell.reshape(-1, 3).min(axis=0), shell.reshape(-1, 3).max(axis=0)
    if (points < low).any() or (points > high).any():
        return False
    for point in points[:: -(-len(points) // _MOST_SAMPLES)]:
        a, b, c = np.moveaxis(shell - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        dots = [np.einsum("fi,fi->f", *pair) for pair in ((a, b), (b, c), (c, a))]
        below = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
        # Solid angles [Oosterom83]; their sum is ±4π inside, with the sign of the outer part's winding.
        solid = 2.0 * np.arctan2(np.linalg.det(np.stack([a, b, c], axis=1)), below).sum()
        if abs(solid) < 2.0 * np.pi:
            return False
    return True
