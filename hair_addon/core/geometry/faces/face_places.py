# SPDX-License-Identifier: GPL-3.0-or-later
"""Places in the polygons of a mesh, independent of the triangulation.

A place is three corners of a polygon and their weights. If the triangulation has changed, for example because a quad
bends the other way, the place is found in the new triangles. In a quad it is projected along the normal of both
diagonals, which keeps neighboring places apart however the quad bends. In quads that are not convex in this projection,
and in larger polygons, it is the closest point.
"""

import numpy as np

from ..mesh import Faces, SurfacePoints, TriMesh

_LEAST_TURN = 1e-3  # least sine of the turn at the corners of a convex quad with sides of equal length


def owners(faces: Faces) -> np.ndarray:
    """Return the polygon (T,) int32 of each triangle; a polygon with n corners has n - 2 consecutive triangles."""
    sizes = np.diff(faces.starts)
    return np.repeat(np.arange(len(sizes), dtype=np.int32), sizes - 2)


def on_triangles(
    mesh: TriMesh, faces: Faces, polygons: np.ndarray, vertices: np.ndarray, weights: np.ndarray
) -> tuple[SurfacePoints, np.ndarray]:
    """Return (`SurfacePoints` on a mesh, (N,) bool: invalid) of places: polygons (N,), vertices and weights (N, 3).

    mesh: the triangulated polygons of `faces`, in order. A place is invalid if a vertex is not a corner of its polygon.
    """
    sizes = np.diff(faces.starts)[polygons]
    corners = corners_of(faces, polygons, vertices)
    are_none = (corners < 0).any(axis=1)
    flat = _flat_quads(mesh.vertices, faces, polygons)
    at_corners = np.where((sizes > 4)[:, None, None], mesh.vertices[vertices], _of_each(flat, corners))
    places = (weights[..., None] * at_corners).sum(axis=1)
    first = faces.starts[polygons] - 2 * polygons
    triangle, barycentric = first.astype(np.int32), np.zeros((len(polygons), 3), np.float32)
    best = np.full(len(polygons), np.inf)
    for step in range(int(sizes.max(initial=3)) - 2):
        rows = np.flatnonzero((step < sizes - 2) & ~are_none)
        triangle_vertices = mesh.triangles[first[rows] + step]
        own_corners = corners_of(faces, polygons[rows], triangle_vertices)
        is_large = (sizes[rows] > 4)[:, None, None]
        at = np.where(is_large, mesh.vertices[triangle_vertices], _of_each(flat[rows], own_corners))
        found, apart = _nearest(at, places[rows])
        is_better = apart < best[rows]
        better = rows[is_better]
        best[better], triangle[better] = apart[is_better], first[better] + step
        barycentric[better] = found[is_better]
    barycentric = np.maximum(barycentric, 0.0)
    barycentric[are_none] = (1.0, 0.0, 0.0)
    return SurfacePoints(triangle, barycentric / barycentric.sum(axis=1, keepdims=True)), are_none


def polygons_with(faces: Faces, vertex_count: int, vertices: np.ndarray) -> np.ndarray:
    """Return the polygon (N,) int32 that has all three vertices (N, 3) as corners, -1 for none.

    vertex_count: of the mesh; negative vertices match no polygon.
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
    """Return indices (V,) int32 of vertices (W, 3) after an edit that match vertices (V, 3) before it, -1 for none.

    Vertices are matched by position. Moved vertices are matched by index, because edits keep the order: between two
    matched vertices there must be as many vertices as before.
    """
    found = _same_places(before, after)
    known = np.append(-1, np.flatnonzero(found >= 0))  # with a sentinel before the first vertex
    there = np.append(-1, found[known[1:]])
    is_taken = np.zeros(len(after) + 1, np.int64)
    is_taken[there[1:] + 1] = 1
    taken = np.cumsum(is_taken)  # number of matched vertices up to each vertex
    gaps = np.diff(known) - 1
    is_kept = (gaps > 0) & (np.diff(known) == np.diff(there))
    is_kept[is_kept] = taken[there[1:][is_kept]] == taken[there[:-1][is_kept] + 1]
    starts, sizes = known[:-1][is_kept] + 1, gaps[is_kept]
    moved = np.repeat(starts - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
    found[moved] = moved + np.repeat(there[:-1][is_kept] - known[:-1][is_kept], sizes)
    return found


def _same_places(before, after):
    """Return `matching_vertices` by bit-identical positions; several vertices at one position are matched in order."""
    rows = np.ascontiguousarray(np.concatenate([before, after]), np.float32) + np.float32(0.0)  # no -0.0
    _places, which = np.unique(rows.view("V12").ravel(), return_inverse=True)
    which, count = which.ravel(), len(before)
    of_before, of_after = (np.bincount(part, minlength=len(_places)) for part in (which[:count], which[count:]))
    is_matched = (of_before == of_after)[which[:count]]
    orders = [np.argsort(part, kind="stable") for part in (which[:count], which[count:])]
    of_those = [part[order] for part, order in zip((which[:count], which[count:]), orders, strict=True)]
    starts = np.searchsorted(of_those[1], of_those[0])
    ranks = np.arange(count) - np.searchsorted(of_those[0], of_those[0])
    found = np.full(count, -1, np.int32)
    is_matched = is_matched[orders[0]]
    found[orders[0][is_matched]] = orders[1][(starts + ranks)[is_matched]]
    return found


def corners_of(faces: Faces, polygons: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Return the corner (N, K) int32 of each vertex (N, K) in its polygon (N,), -1 if the vertex is at no corner."""
    sizes, starts = np.diff(faces.starts)[polygons], faces.starts[polygons]
    found = np.full(vertices.shape, -1, np.int32)
    for corner in range(int(sizes.max(initial=0)) - 1, -1, -1):
        rows = np.flatnonzero(corner < sizes)
        is_it = faces.corner_vertices[starts[rows] + corner][:, None] == vertices[rows]
        found[rows] = np.where(is_it, corner, found[rows])
    return found


def _flat_quads(vertices, faces, polygons):
    """Return corners (N, 4, 3) float64 of the quads among polygons (N,), projected to a plane along the diagonals.

    Quads that are not convex in the plane keep their positions.
    """
    flat = np.zeros((len(polygons), 4, 3))
    quads = np.flatnonzero(np.diff(faces.starts)[polygons] == 4)
    at = vertices[faces.corner_vertices[faces.starts[polygons[quads]][:, None] + np.arange(4)]].astype(np.float64)
    seen = at - at[:, :1]
    normals = np.cross(at[:, 2] - at[:, 0], at[:, 3] - at[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    seen -= np.einsum("qcx,qx->qc", seen, normals)[..., None] * normals[:, None]
    sides = np.roll(seen, -1, axis=1) - seen
    turns = np.einsum("qcx,qx->qc", np.cross(np.roll(sides, 1, axis=1), sides), normals)
    longest = np.einsum("qcx,qcx->qc", sides, sides).max(axis=1, keepdims=True)
    is_convex = (turns > _LEAST_TURN * longest).all(axis=1)
    flat[quads] = np.where(is_convex[:, None, None], seen, at)
    return flat


def _of_each(flat, corners):
    """Return the positions (N, 3, 3) of corners (N, 3); corners beyond four, of larger polygons, are placeholders."""
    return np.take_along_axis(flat, np.where((corners < 0) | (corners > 3), 0, corners)[..., None], axis=1)


def _nearest(triangles, places):
    """Return (barycentric (N, 3), distance² (N,)) of the points of triangles (N, 3, 3) closest to places (N, 3)."""
    inside = _barycentric(triangles, places)
    best, least = inside, np.where((inside >= 0.0).all(axis=1), _apart(triangles, inside, places), np.inf)
    for corner in range(3):
        following = (corner + 1) % 3
        along = triangles[:, following] - triangles[:, corner]
        square = np.einsum("ni,ni->n", along, along)
        part = np.einsum("ni,ni->n", places - triangles[:, corner], along) / np.where(square > 0.0, square, np.inf)
        on_side = np.zeros_like(inside)
        on_side[:, following] = np.clip(part, 0.0, 1.0)
        on_side[:, corner] = 1.0 - on_side[:, following]
        apart = _apart(triangles, on_side, places)
        is_nearer = apart < least
        best, least = np.where(is_nearer[:, None], on_side, best), np.where(is_nearer, apart, least)
    return best, least


def _apart(triangles, barycentric, places):
    between = np.einsum("nc,ncx->nx", barycentric, triangles) - places
    return np.einsum("ni,ni->n", between, between)


def _barycentric(triangles, places):
    """Return barycentric coordinates (N, 3) of places (N, 3) projected to the planes of triangles (N, 3, 3)."""
    first = triangles[:, 0]
    along, across, place = triangles[:, 1] - first, triangles[:, 2] - first, places - first
    square, product, other = (
        np.einsum("ni,ni->n", *pair) for pair in ((along, along), (along, across), (across, across))
    )
    on_along, on_across = (np.einsum("ni,ni->n", place, edge) for edge in (along, across))
    area = square * other - product * product
    area = np.where(area > 0.0, area, np.inf)  # triangles of zero area
    second = (other * on_along - product * on_across) / area
    third = (square * on_across - product * on_along) / area
    return np.stack([1.0 - second - third, second, third], axis=1)
