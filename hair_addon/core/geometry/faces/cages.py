# SPDX-License-Identifier: GPL-3.0-or-later
"""Recovery of the cage, the faces before subdivision, from a subdivided mesh at any level.

A subdivided mesh has the vertices of its cage first. Each corner of the cage corresponds to one corner of the mesh, in
order, and to an equal number of quads: all quads of the first corner, then all of the next.
"""

import numpy as np

from ..mesh import Faces


def cage_vertices(faces: Faces, corner_count: int) -> np.ndarray:
    """Return the vertices (N,) int32 at the corners of a cage, concatenated over faces.

    corner_count: of the cage, 0 without subdivision. Without subdivision the corner vertices of `faces` are returned.
    """
    vertices = faces.corner_vertices
    if corner_count:
        up_to = np.cumsum(np.bincount(vertices))
        last = int(np.searchsorted(up_to, corner_count))
        if last < len(up_to) and up_to[last] == corner_count:
            return vertices[vertices <= last]
    return vertices


def cage_starts(faces: Faces, corner_count: int) -> np.ndarray | None:
    """Return (F + 1,) int: the first quad of each face of a cage, and the number of quads at the end.

    None if unknown. corner_count: see `cage_vertices`.
    """
    of_cage = cage_vertices(faces, corner_count)
    if of_cage is faces.corner_vertices or (np.diff(faces.starts) != 4).any():
        return None
    quads = faces.corner_vertices.reshape(-1, 4)
    per_corner, rest = divmod(len(quads), corner_count)
    if not per_corner or rest:
        return None
    # The vertices inside the cage's faces come last, in the order of the faces, and each quad has one of them.
    inside = quads.max(axis=1)
    is_first = np.append(True, np.maximum.accumulate(inside)[:-1] < np.minimum.accumulate(inside[::-1])[::-1][1:])
    starts = np.append(np.flatnonzero(is_first & (np.arange(len(quads)) % per_corner == 0)), len(quads))
    return None if (np.diff(starts) < 3 * per_corner).any() else starts


def cage_faces(faces: Faces, corner_count: int, own: Faces | None = None) -> tuple[Faces, np.ndarray] | None:
    """Return (`Faces` of a cage, (F,) int: a subdivided face in each face of the cage); None if unknown.

    corner_count: see `cage_vertices`; own: the cage's `Faces`, if their corners match.
    """
    corners = cage_vertices(faces, corner_count)
    if corners is faces.corner_vertices or not len(corners) or len(faces.starts) - 1 < corner_count:
        return None
    per_corner = (len(faces.starts) - 1) // corner_count
    if own is not None and np.array_equal(own.corner_vertices, corners):
        return Faces(corners, own.starts), own.starts[:-1] * per_corner
    starts = cage_starts(faces, corner_count)
    if starts is None:
        return None
    return Faces(corners, (starts // per_corner).astype(np.int32)), starts[:-1]


def triangle_corners(faces: Faces, vertices: np.ndarray) -> np.ndarray:
    """Return the corners (T, 3) int32 of triangulated faces; triangles and quads are cut as in Blender.

    vertices: (V, 3). Larger faces become fans, which callers may replace.
    """
    sizes = np.diff(faces.starts)
    counts = np.maximum(sizes - 2, 0)
    owner = np.repeat(np.arange(len(sizes)), counts)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    first = faces.starts[:-1][owner]
    corners = np.stack([first, first + step + 1, first + step + 2], axis=1).astype(np.int32)
    quads = np.flatnonzero(sizes == 4)
    at = vertices[faces.corner_vertices[faces.starts[:-1][quads][:, None] + np.arange(4)]]
    second, third, fourth = (at[:, corner] - at[:, 0] for corner in (1, 2, 3))
    with np.errstate(invalid="ignore", over="ignore"):
        is_flipped = np.einsum("qi,qi->q", np.cross(second, third), np.cross(fourth, third)) > 0.0
    flipped = quads[is_flipped]
    at_first = (np.cumsum(counts) - counts)[flipped]
    corners[at_first, 2] += 1
    corners[at_first + 1, 0] += 1
    return corners
