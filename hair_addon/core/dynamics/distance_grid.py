# SPDX-License-Identifier: GPL-3.0-or-later
"""How far points are from colliders at least, on a grid: which of them need not ask for the nearest surface.

A vertex of the grid knows its distance from the nearest cell that a triangle may touch. A point is no nearer to a
surface than the vertex beside it is, less the way between the two; and a point outside the grid, which contains all
triangles, no nearer than that place of the grid that is nearest to it is, across the way there.
"""

import math
from typing import Any

import numpy as np
import warp as wp

from ..kernels import native_code

_FARTHEST = 15  # cells that are looked at: farther vertices know that they are as far as that
_MOST_CELLS_ALONG = 64
_SLACK = 1e-3  # of a cell, that triangles are larger


@wp.struct
class DistanceGrid:
    """For kernels. Vertices are at `low + size (i, j, k)`; `distances` is empty where nothing is known."""

    low: wp.vec3
    last: wp.vec3i  # vertices along each axis, less one
    size: float  # of a cell [m]
    drift: float  # that triangles have moved since, at most [m]
    distances: wp.array3d[float]  # [m]


# The least distance [m] that a point may have from any surface: zero near one.
@wp.func_native(native_code.body(__file__, "distance_grid.cpp", WIDTH=1))
def least_distance(grid: DistanceGrid, point: wp.vec3) -> float: ...


def cell_size(extent: np.ndarray, cell_count: int) -> float:
    """The size [m] of about as many cells as that in a box (3,) [m]."""
    longest = float(extent.max())
    along = min(max(math.cbrt(cell_count), 4.0), _MOST_CELLS_ALONG)
    return max(longest / along, (math.prod(np.maximum(extent, longest / along)) / cell_count) ** (1.0 / 3.0), 1e-6)


def distance_grid(vertices: np.ndarray, triangles: np.ndarray, cell_count: int, device: Any) -> DistanceGrid:
    """The grid of triangles (F, 3) with vertices (V, 3) [m], of about `cell_count` cells, at most 64 along an axis."""
    low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
    size = cell_size(high - low, cell_count)
    low = low - 0.5 * size
    counts = np.ceil((high - low) / size + 0.5).astype(int)
    squares = _squares(_touched((vertices - low) / size, triangles, counts))
    grid = DistanceGrid()
    grid.low, grid.last, grid.size, grid.drift = wp.vec3(*map(float, low)), wp.vec3i(*map(int, counts)), size, 0.0
    distances = np.sqrt(squares, dtype=np.float32) * np.float32(size)
    grid.distances = wp.array(distances, dtype=float, device=device)
    return grid


def _touched(places, triangles, counts):
    """(I, J, K) bool of vertices: those of cells that the box of a triangle touches; places: in cells."""
    corners = [places[triangles[:, corner]] for corner in range(3)]
    first = np.floor(np.minimum(np.minimum(*corners[:2]), corners[2]) - _SLACK).astype(int)
    last = np.floor(np.maximum(np.maximum(*corners[:2]), corners[2]) + _SLACK).astype(int) + 1  # a vertex
    # Boxes are counted as differences, whose sums along the axes they are.
    shape = counts + 2
    changes = np.zeros(math.prod(shape), np.int32)
    for axes in np.ndindex(2, 2, 2):
        corner = np.where(axes, last + 1, first)
        rows = (corner[:, 0] * shape[1] + corner[:, 1]) * shape[2] + corner[:, 2]
        changes += (1 - 2 * (sum(axes) % 2)) * np.bincount(rows, minlength=len(changes)).astype(np.int32)
    counted = changes.reshape(shape)
    for axis in range(3):
        counted = np.cumsum(counted, axis=axis, dtype=np.int32)
    return counted[:-1, :-1, :-1] > 0


def _squares(is_touched):
    """(I, J, K) squared distances from the nearest that is, in cells: along one axis after the other."""
    squares = np.where(is_touched, 0, _FARTHEST**2).astype(np.uint16)
    for axis in range(3):
        along = np.moveaxis(squares, axis, 0)
        nearest = along.copy()
        for way in range(1, min(_FARTHEST, len(along))):
            there = along + np.uint16(way**2)
            np.minimum(nearest[way:], there[:-way], out=nearest[way:])
            np.minimum(nearest[:-way], there[way:], out=nearest[:-way])
        squares = np.moveaxis(nearest, 0, axis)
    return np.ascontiguousarray(squares)
