# SPDX-License-Identifier: GPL-3.0-or-later
"""Places in the polygons of a mesh, whichever triangles these are cut into.

A place is three corners of a polygon and their weights. Where the polygon is cut otherwise, such as a quad that bends
the other way now, the place is found in the triangles that it has: of a quad as if it were a square, which keeps
neighboring places apart however it bends, and of polygons with more corners the nearest.
"""

import numpy as np

from .mesh import Faces, SurfacePoints, TriMesh

# The corners of a square, of which a triangle has three; the last stands for those of polygons that have more.
_SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0)], np.float64)


def owners(faces: Faces) -> np.ndarray:
    """(T,) int32: the polygon of each triangle, of which one with n corners has n - 2, polygon after polygon."""
    sizes = np.diff(faces.starts)
    return np.repeat(np.arange(len(sizes), dtype=np.int32), sizes - 2)


def on_triangles(
    mesh: TriMesh, faces: Faces, polygons: np.ndarray, vertices: np.ndarray, weights: np.ndarray
) -> tuple[SurfacePoints, np.ndarray]:
    """(`SurfacePoints` on a mesh, (N,) bool: which are none) of places (N,) polygons, (N, 3) vertices and weights.

    mesh: the polygons of `faces` cut into triangles, polygon after polygon. A place is none where a vertex is no corner
    of its polygon.
    """
    sizes = np.diff(faces.starts)[polygons]
    corners = corners_of(faces, polygons, vertices)
    are_none = (corners < 0).any(axis=1)
    at_corners = np.where((sizes > 4)[:, None, None], mesh.vertices[vertices], _SQUARE[np.minimum(corners, 4)])
    places = (weights[..., None] * at_corners).sum(axis=1)
    first = faces.starts[polygons] - 2 * polygons
    triangle, barycentric = first.astype(np.int32), np.zeros((len(polygons), 3), np.float32)
    best = np.full(len(polygons), -np.inf)
    for step in range(int(sizes.max(initial=3)) - 2):
        rows = np.flatnonzero((step < sizes - 2) & ~are_none)
        there = mesh.triangles[first[rows] + step]
        own_corners = corners_of(faces, polygons[rows], there)
        is_large = (sizes[rows] > 4)[:, None, None]
        found = _barycentric(
            np.where(is_large, mesh.vertices[there], _SQUARE[np.minimum(own_corners, 4)]), places[rows]
        )
        least = found.min(axis=1)
        is_better = least > best[rows]
        better = rows[is_better]
        best[better], triangle[better] = least[is_better], first[better] + step
        barycentric[better] = found[is_better]
    barycentric = np.maximum(barycentric, 0.0)
    barycentric[are_none] = (1.0, 0.0, 0.0)
    return SurfacePoints(triangle, barycentric / barycentric.sum(axis=1, keepdims=True)), are_none


def polygons_with(faces: Faces, vertex_count: int, vertices: np.ndarray) -> np.ndarray:
    """(N,) int32: the polygon that has three vertices (N, 3) among its corners, -1 where none has.

    vertex_count: of the mesh; negative vertices are of no polygon.
    """
    found = np.full(len(vertices), -1, np.int32)
    rows = np.flatnonzero((vertices >= 0).all(axis=1))
    starts, around = faces.around(vertex_count)
    sizes = np.diff(faces.starts)
    known = np.sort(np.repeat(np.arange(len(sizes), dtype=np.int64), sizes) * vertex_count + faces.corner_vertices)

    def are_corners(of_polygons, wanted):
        keys = of_polygons.astype(np.int64) * vertex_count + wanted
        return known[np.minimum(np.searchsorted(known, keys), len(known) - 1)] == keys

    step = 0
    while len(rows):
        begin = starts[vertices[rows, 0]] + step
        rows, begin = (kept[begin < starts[vertices[rows, 0] + 1]] for kept in (rows, begin))
        polygons = around[begin]
        is_it = are_corners(polygons, vertices[rows, 1]) & are_corners(polygons, vertices[rows, 2])
        found[rows[is_it]] = polygons[is_it]
        rows = rows[~is_it]
        step += 1
    return found


def matching_vertices(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """(V,) int32: which of the vertices (W, 3) after an edit each of those (V, 3) before it is, -1 where none is.

    They are known by their places. Those that have moved are known by their neighbors in order, which edits keep:
    between two that are known there are as many as before.
    """
    found = _same_places(before, after)
    known = np.append(-1, np.flatnonzero(found >= 0))  # as if one more before the first had stayed there
    there = np.append(-1, found[known[1:]])
    is_taken = np.zeros(len(after) + 1, np.int64)
    is_taken[there[1:] + 1] = 1
    taken = np.cumsum(is_taken)  # up to each vertex
    gaps = np.diff(known) - 1
    is_kept = (gaps > 0) & (np.diff(known) == np.diff(there))
    is_kept[is_kept] = taken[there[1:][is_kept]] == taken[there[:-1][is_kept] + 1]
    starts, sizes = known[:-1][is_kept] + 1, gaps[is_kept]
    moved = np.repeat(starts - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
    found[moved] = moved + np.repeat(there[:-1][is_kept] - known[:-1][is_kept], sizes)
    return found


def _same_places(before, after):
    """(V,) int32: vertices at the same places, to the last bit; where several are, in their order."""
    rows = np.ascontiguousarray(np.concatenate([before, after]), np.float32) + np.float32(0.0)  # no -0.0
    _places, which = np.unique(rows.view("V12").ravel(), return_inverse=True)
    which, count = which.ravel(), len(before)
    of_before, of_after = (np.bincount(part, minlength=len(_places)) for part in (which[:count], which[count:]))
    is_told = (of_before == of_after)[which[:count]]
    orders = [np.argsort(part, kind="stable") for part in (which[:count], which[count:])]
    of_those = [part[order] for part, order in zip((which[:count], which[count:]), orders, strict=True)]
    starts = np.searchsorted(of_those[1], of_those[0])
    ranks = np.arange(count) - np.searchsorted(of_those[0], of_those[0])
    found = np.full(count, -1, np.int32)
    is_told = is_told[orders[0]]
    found[orders[0][is_told]] = orders[1][(starts + ranks)[is_told]]
    return found


def corners_of(faces, polygons, vertices):
    """(N, K) int32: which corner of its polygon each of the vertices (N, K) is, -1 for none."""
    sizes, starts = np.diff(faces.starts)[polygons], faces.starts[polygons]
    found = np.full(vertices.shape, -1, np.int32)
    for corner in range(int(sizes.max(initial=0)) - 1, -1, -1):
        rows = np.flatnonzero(corner < sizes)
        is_it = faces.corner_vertices[starts[rows] + corner][:, None] == vertices[rows]
        found[rows] = np.where(is_it, corner, found[rows])
    return found


def _barycentric(triangles, places):
    """(N, 3) barycentric coordinates of places (N, 3), above or below triangles (N, 3, 3)."""
    first = triangles[:, 0]
    along, across, place = triangles[:, 1] - first, triangles[:, 2] - first, places - first
    square, product, other = (
        np.einsum("ni,ni->n", *pair) for pair in ((along, along), (along, across), (across, across))
    )
    on_along, on_across = (np.einsum("ni,ni->n", place, edge) for edge in (along, across))
    area = square * other - product * product
    area = np.where(area > 0.0, area, np.inf)  # nothing is found on triangles without an area
    second = (other * on_along - product * on_across) / area
    third = (square * on_across - product * on_along) / area
    return np.stack([1.0 - second - third, second, third], axis=1)
