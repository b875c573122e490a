# SPDX-License-Identifier: GPL-3.0-or-later
"""Lower bounds of the distance from colliders, on a grid: points that are far away need no surface query.

Each vertex of the grid stores its distance from the nearest cell that a triangle may touch. A lower bound at a point is
the distance stored at the nearest vertex minus the distance between point and vertex. Outside the grid, which contains
all triangles, the bound at the closest place of the grid and the distance to this place are combined.
"""

import math
from typing import Any

import numpy as np
import warp as wp

from ...kernels import kernel_cache, native_code

wp.set_module_options({"enable_backward": False})

_FARTHEST = wp.constant(15)  # largest stored distance in cells
_MOST_CELLS_ALONG = 64
_SLACK = wp.constant(1e-3)  # enlargement of triangles, relative to a cell


@wp.struct
class GridPlace:
    """The values of a `DistanceGrid` without `distances`."""

    low: wp.vec3
    last: wp.vec3i
    size: float
    drift: float


@wp.struct
class DistanceGrid:
    """A grid for kernels, with vertices at `low + size (i, j, k)`."""

    low: wp.vec3
    last: wp.vec3i  # number of vertices along each axis - 1
    size: float  # of a cell [m]
    drift: float  # largest motion of triangles since the grid was built [m]
    distances: wp.array3d[float]  # [m]


# Lower bound of the distance [m] of a point from any surface; zero near a surface.
@wp.func_native(native_code.body(__file__, "distance_grid.cpp", WIDTH=1))
def least_distance(grid: DistanceGrid, point: wp.vec3) -> float: ...


def cell_size(extent: np.ndarray, cell_count: int) -> float:
    """Return the size [m] of the cells that divide a box of an extent (3,) [m] into about `cell_count` cells."""
    longest = float(extent.max())
    along = min(max(math.cbrt(cell_count), 4.0), _MOST_CELLS_ALONG)
    return max(longest / along, (math.prod(np.maximum(extent, longest / along)) / cell_count) ** (1.0 / 3.0), 1e-6)


def distance_grid(vertices: np.ndarray, triangles: np.ndarray, cell_count: int, device: Any) -> DistanceGrid:
    """Return the grid of triangles (F, 3) with vertices (V, 3) [m].

    It has about `cell_count` cells, and at most 64 cells along an axis.
    """
    low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
    size = cell_size(high - low, cell_count)
    low = low - 0.5 * size
    counts = np.ceil((high - low) / size + 0.5).astype(int)
    places = (vertices - low) / size
    grid = DistanceGrid()
    grid.low, grid.last, grid.size, grid.drift = wp.vec3(*map(float, low)), wp.vec3i(*map(int, counts)), size, 0.0
    if wp.get_device(device).is_cpu:
        distances = np.sqrt(_squares(_touched(places, triangles, counts)), dtype=np.float32) * np.float32(size)
        grid.distances = wp.array(distances, dtype=float, device=device)
    else:
        grid.distances = distances_by_kernels(places, triangles, counts, size, device)
    return grid


def distances_by_kernels(
    places: np.ndarray, triangles: np.ndarray, counts: np.ndarray, size: float, device: Any
) -> wp.array:
    """Return distances (counts + 1) [m] equal to NumPy's; a GPU takes a fiftieth of NumPy's time.

    places: (V, 3) of vertices, in cells; size: of a cell [m].
    """
    shape = tuple(int(count) + 1 for count in counts)
    squares = wp.full(shape, _FARTHEST**2, dtype=int, device=device)
    vertices = wp.array(places.astype(np.float32), dtype=wp.vec3, device=device)
    faces = wp.array(np.ascontiguousarray(triangles, np.int32), dtype=int, device=device)
    kernel_cache.launch(_touch, len(faces), inputs=[vertices, faces], outputs=[squares], device=device)
    for axis in np.eye(3, dtype=int).tolist():
        nearest = wp.empty_like(squares)
        kernel_cache.launch(_spread, shape, inputs=[squares, wp.vec3i(*axis)], outputs=[nearest], device=device)
        squares = nearest
    distances = wp.empty(shape, dtype=float, device=device)
    kernel_cache.launch(_put_roots, shape, inputs=[squares, size], outputs=[distances], device=device)
    return distances


@wp.kernel
def _touch(
    places: wp.array[wp.vec3],
    triangles: wp.array2d[int],
    # outputs
    out_squares: wp.array3d[int],
):
    """Write zero at the vertices of cells that a triangle's bounding box touches."""
    triangle = wp.tid()
    a = places[triangles[triangle, 0]]
    b = places[triangles[triangle, 1]]
    c = places[triangles[triangle, 2]]
    low = wp.min(wp.min(a, b), c)
    high = wp.max(wp.max(a, b), c)
    first = wp.vec3i()
    end = wp.vec3i()
    for axis in range(3):
        first[axis] = int(wp.floor(low[axis] - _SLACK))
        end[axis] = int(wp.floor(high[axis] + _SLACK)) + 2
    for i in range(first[0], end[0]):
        for j in range(first[1], end[1]):
            for k in range(first[2], end[2]):
                out_squares[i, j, k] = 0


@wp.kernel
def _spread(
    squares: wp.array3d[int],
    axis: wp.vec3i,
    # outputs
    out_squares: wp.array3d[int],
):
    """Extend squared distances along one more axis."""
    i, j, k = wp.tid()
    place = wp.vec3i(i, j, k)
    along = wp.dot(axis, place)
    last = wp.dot(axis, wp.vec3i(squares.shape[0], squares.shape[1], squares.shape[2])) - 1
    nearest = squares[i, j, k]
    for way in range(1, _FARTHEST):
        if way <= along:
            at = place - way * axis
            nearest = wp.min(nearest, squares[at[0], at[1], at[2]] + way * way)
        if along + way <= last:
            at = place + way * axis
            nearest = wp.min(nearest, squares[at[0], at[1], at[2]] + way * way)
    out_squares[i, j, k] = nearest


@wp.kernel
def _put_roots(
    squares: wp.array3d[int],
    size: float,
    # outputs
    out_distances: wp.array3d[float],
):
    i, j, k = wp.tid()
    out_distances[i, j, k] = size * wp.sqrt(float(squares[i, j, k]))


def _touched(places, triangles, counts):
    """Return (I, J, K) bool: vertices of cells that a triangle's bounding box touches; places: in cells."""
    corners = [places[triangles[:, corner]] for corner in range(3)]
    first = np.floor(np.minimum(np.minimum(*corners[:2]), corners[2]) - _SLACK).astype(int)
    last = np.floor(np.maximum(np.maximum(*corners[:2]), corners[2]) + _SLACK).astype(int) + 1  # last touched vertex
    # Boxes are accumulated as differences, and counted by cumulative sums along the axes.
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
    """Return squared distances (I, J, K) from the nearest touched vertex, in cells, one axis after the other."""
    squares = np.where(is_touched, 0, _FARTHEST**2).astype(np.uint16)
    for axis in range(3):
        along = np.moveaxis(squares, axis, 0)
        nearest = along.copy()
        for way in range(1, min(_FARTHEST, len(along))):
            shifted = along + np.uint16(way**2)
            np.minimum(nearest[way:], shifted[:-way], out=nearest[way:])
            np.minimum(nearest[:-way], shifted[way:], out=nearest[:-way])
        squares = np.moveaxis(nearest, 0, axis)
    return np.ascontiguousarray(squares)
