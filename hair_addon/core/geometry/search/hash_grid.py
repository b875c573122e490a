# SPDX-License-Identifier: GPL-3.0-or-later
"""Neighbor search: the sorted spatial hash of [Report12] section 2.4 [Teschner03], as `wp.HashGrid` builds it.

Warp's grid visits all 27 cells around a query, each once (the report's 26 omit the query's own cell).
"""

import math

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import kernel_cache, native_code, parallel
from ...kernels.parallel import Rows
from . import counting_sort

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

GRID_SIZE = 32  # cells along each axis; distant cells wrap around and share a bucket, which only costs time
CELLS_PER_RADIUS = 2.0  # cell width / first search radius: visiting fewer cells is faster than comparing fewer points
CELL_WIDTH = 0.8  # width of the cells that sort the queries / first search radius
CELLS_ALONG = 1024  # maximum number of sorting cells along each axis
CANDIDATE_LIMIT = 128  # maximum number of candidate points for the queries of one cell
candidate_indices = wp.types.vector(length=CANDIDATE_LIMIT, dtype=int)
candidate_values = wp.types.vector(length=CANDIDATE_LIMIT, dtype=float)
LIMIT = 64  # maximum number of neighbors of a query
key_list = wp.types.vector(length=LIMIT, dtype=wp.uint64)
NO_KEY = wp.constant(wp.uint64(2**64 - 1))
QUERIES_AT_ONCE = 8  # queries of a cell in one pass, in vector registers
SLOTS_AT_ONCE = 9
SHORT = -2  # replaces the nearest point's index if too few points were found: the query needs a wider search
WIDENINGS = 3  # doublings of the search radius before a brute-force search


@wp.func
def key_of(squared: float, point: int):
    """Return a key that sorts by squared distance, then by index; bits of non-negative floats sort like the values."""
    return wp.bit_or(wp.lshift(wp.uint64(wp.cast(squared, dtype=wp.uint32)), wp.uint64(32)), wp.uint64(point))


@wp.func
def point_of(key: wp.uint64):
    """Return the index in a key."""
    return int(wp.bit_and(key, wp.uint64(0xFFFFFFFF)))


@wp.func
def square_of(key: wp.uint64):
    """Return the squared distance in a key."""
    return wp.cast(wp.uint32(wp.rshift(key, wp.uint64(32))), dtype=float)


@wp.func
def _inserted(nearest: key_list, key: wp.uint64, limit: int):
    """Insert a key in order and drop the last one, without branches."""
    for slot in range(limit):
        other = nearest[slot]
        nearest[slot] = wp.min(other, key)
        key = wp.max(other, key)
    return nearest


@wp.func
def _squared_distance(point: wp.vec3, position: wp.vec3):
    return wp.length_sq(point - position)


@wp.func
def _widened(
    points: wp.array[wp.vec3],
    position: wp.vec3,
    grid: wp.uint64,
    distance: float,
    first_radius: float,
    widening: int,
    limit: int,
):
    """Search with a growing radius until enough keys are found, or any key within the whole distance."""
    nearest = key_list(NO_KEY)
    searching = bool(True)
    while searching and widening <= WIDENINGS:
        radius = first_radius * float(1 << widening)
        nearest = key_list(NO_KEY)
        for point in wp.hash_grid_query(grid, position, radius):
            squared = _squared_distance(points[point], position)
            if squared < radius * radius:
                nearest = _inserted(nearest, key_of(squared, point), limit)
        searching = nearest[limit - 1] == NO_KEY and (radius < distance or nearest[0] == NO_KEY)
        widening += 1
    if searching:
        nearest = key_list(NO_KEY)
        for point in range(points.shape[0]):
            nearest = _inserted(nearest, key_of(_squared_distance(points[point], position), point), limit)
    return nearest


@wp.func
def _write(nearest: key_list, distance: float, out_indices: wp.array[int], out_distances: wp.array[float]):
    for slot in range(out_indices.shape[0]):
        key = nearest[slot]
        point = point_of(key)
        apart = wp.sqrt(square_of(key))
        # Points out of range are dropped, except for the nearest.
        if key == NO_KEY or (slot > 0 and apart >= distance):
            point = -1
            apart = wp.inf
        out_indices[slot] = point
        out_distances[slot] = apart


@wp.kernel
def _cells(
    queries: wp.array[wp.vec3],
    low: wp.vec3,
    per_width: float,
    counts: wp.vec3i,
    # outputs
    out_cells: wp.array[int],
):
    query = wp.tid()
    cell = int(0)
    for axis in range(3):
        along = wp.clamp(per_width * (queries[query][axis] - low[axis]), 0.0, float(counts[axis] - 1))
        cell = counts[axis] * cell + int(along)
    out_cells[query] = cell


@wp.func_native(
    native_code.body(
        __file__,
        "hash_grid.cpp",
        QUERIES_AT_ONCE=QUERIES_AT_ONCE,
        CANDIDATE_LIMIT=CANDIDATE_LIMIT,
        LIMIT=LIMIT,
        SLOTS_AT_ONCE=SLOTS_AT_ONCE,
        SHORT=SHORT,
    )
)
def _rank(
    queries: wp.array[wp.vec3],
    order: wp.array[int],
    first: int,
    end: int,
    candidate_count: int,
    candidates: candidate_indices,
    candidates_x: candidate_values,
    candidates_y: candidate_values,
    candidates_z: candidate_values,
    distance: float,
    first_radius: float,
    out_indices: wp.array2d[int],
    out_distances: wp.array2d[float],
): ...


@wp.kernel
def _by_cells(
    points: wp.array[wp.vec3],
    queries: wp.array[wp.vec3],
    order: wp.array[int],
    firsts: wp.array[int],
    ends: wp.array[int],
    grid: wp.uint64,
    distance: float,
    first_radius: float,
    # outputs
    out_indices: wp.array2d[int],
    out_distances: wp.array2d[float],
):
    cell = wp.tid()
    first = firsts[cell]
    end = ends[cell]
    low = queries[order[first]]
    high = low
    for place in range(first + 1, end):
        low = wp.min(low, queries[order[place]])
        high = wp.max(high, queries[order[place]])
    # All points in reach of any query of the cell, in ascending order: collected once for all queries.
    candidates = candidate_indices()
    count = int(0)
    for point in wp.hash_grid_query(grid, 0.5 * (low + high), first_radius + 0.5 * wp.length(high - low)):
        position = points[point]
        if _squared_distance(position, wp.min(wp.max(position, low), high)) < first_radius * first_radius:
            if count < CANDIDATE_LIMIT:
                slot = count
                while slot > 0 and candidates[slot - 1] > point:
                    candidates[slot] = candidates[slot - 1]
                    slot -= 1
                candidates[slot] = point
            count += 1
    are_all = count <= CANDIDATE_LIMIT
    if are_all:
        x = candidate_values()
        y = candidate_values()
        z = candidate_values()
        for slot in range(count):
            position = points[candidates[slot]]
            x[slot] = position[0]
            y[slot] = position[1]
            z[slot] = position[2]
        _rank(
            queries,
            order,
            first,
            end,
            count,
            candidates,
            x,
            y,
            z,
            distance,
            first_radius,
            out_indices,
            out_distances,
        )
    limit = out_indices.shape[1]
    for place in range(first, end):
        query = order[place]
        if not are_all or out_indices[query, 0] == SHORT:
            nearest = _widened(points, queries[query], grid, distance, first_radius, wp.where(are_all, 1, 0), limit)
            _write(nearest, distance, out_indices[query], out_distances[query])


@wp.kernel
def _by_queries(
    points: wp.array[wp.vec3],
    queries: wp.array[wp.vec3],
    grid: wp.uint64,
    distance: float,
    first_radius: float,
    # outputs
    out_indices: wp.array2d[int],
    out_distances: wp.array2d[float],
):
    query = wp.tid()
    nearest = _widened(points, queries[query], grid, distance, first_radius, 0, out_indices.shape[1])
    _write(nearest, distance, out_indices[query], out_distances[query])


def neighbours(
    points: wp.array[wp.vec3], queries: wp.array[wp.vec3], distance: float, limit: int
) -> tuple[wp.array2d[int], wp.array2d[float]]:
    """Return the nearest points within a distance of each query: at most `limit`, at least one.

    points (N,) and queries (Q,) are vec3 arrays [m] on one device, N > 0; distance [m]. The result is indices (Q,
    limit) int32 and distances (Q, limit) float32 [m] on the device; rows are sorted by distance and then by index, and
    unused slots are -1 and infinity. A query without a point in range gets the nearest one. Raises `HairError`.
    """
    if not (math.isfinite(distance) and distance > 0.0):  # also refuses NaN, which wp.HashGrid does not
        raise HairError(f"The search distance must be positive and finite, not {distance:g} m.")
    if len(points) == 0:
        raise HairError("There are no guides: generate guides first.")
    if not 1 <= limit <= LIMIT:
        raise ValueError(f"at least one and at most {LIMIT} neighbours can be found, not {limit}")
    device = points.device
    indices = wp.empty((len(queries), limit), dtype=int, device=device)
    distances = wp.empty((len(queries), limit), dtype=float, device=device)
    if len(queries) == 0:
        return indices, distances
    # The grid would write non-finite coordinates outside of its memory.
    if not (np.isfinite(points.numpy()).all() and (device.is_cuda or np.isfinite(queries.numpy()).all())):
        raise HairError("Some guides or strands have roots with non-finite coordinates: repair the surface.")
    first_radius = _first_radius(points.numpy(), distance, limit)
    grid = wp.HashGrid(GRID_SIZE, GRID_SIZE, GRID_SIZE, device=device)
    grid.build(points, CELLS_PER_RADIUS * first_radius)
    by = by_cells if device.is_cpu else by_queries
    by(points, queries, grid, distance, first_radius, indices, distances)
    return indices, distances


def by_queries(
    points: wp.array[wp.vec3],
    queries: wp.array[wp.vec3],
    grid: wp.HashGrid,
    distance: float,
    first_radius: float,
    out_indices: wp.array2d[int],
    out_distances: wp.array2d[float],
) -> None:
    """Fill the rows of `neighbours`, each query separately; for GPUs."""
    kernel_cache.launch(
        _by_queries,
        dim=len(queries),
        inputs=[points, queries, grid.id, distance, first_radius],
        outputs=[out_indices, out_distances],
        device=points.device,
    )


def by_cells(
    points: wp.array[wp.vec3],
    queries: wp.array[wp.vec3],
    grid: wp.HashGrid,
    distance: float,
    first_radius: float,
    out_indices: wp.array2d[int],
    out_distances: wp.array2d[float],
) -> None:
    """Fill the rows of `neighbours`, all queries of a cell together; for CPUs, where this is twice as fast."""
    device = points.device
    order, bounds = _sorted_by_cell(points.numpy(), queries, CELL_WIDTH * first_radius)
    order, firsts, ends = (wp.array(part, dtype=int, device=device) for part in (order, bounds[:-1], bounds[1:]))
    parallel.launch(
        _by_cells,
        len(firsts),
        inputs=[
            points,
            queries,
            order,
            Rows(firsts),
            Rows(ends),
            grid.id,
            distance,
            first_radius,
            out_indices,
            out_distances,
        ],
        outputs=[],
        device=device,
        least_rows=256,
    )


def _sorted_by_cell(points, queries, width):
    """Return indices (Q,) int32 of queries sorted by cell, and the start of each cell, the end included.

    Cells of a width [m] fill the bounding box of points (N, 3); queries outside are assigned to its border cells.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    width = max(width, float((high - low).max()) / CELLS_ALONG)
    counts = np.minimum((high - low) / width, CELLS_ALONG - 1).astype(int) + 1
    cells = wp.empty(len(queries), dtype=int, device=queries.device)
    parallel.launch(
        _cells,
        len(queries),
        inputs=[Rows(queries), wp.vec3(*low.tolist()), 1.0 / width, wp.vec3i(*counts.tolist())],
        outputs=[cells],
        device=queries.device,
    )
    return counting_sort.grouped(cells.numpy(), int(counts.prod()))


def _first_radius(points, distance, limit):
    """Return the first search radius [m]: the distance, unless it typically contains far too many or no points."""
    extent = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    # Mean spacing of points on a surface; a single point gets wide cells, which are few.
    spacing = extent / math.sqrt(len(points)) if extent else distance
    # Cells need not be narrower than the rounding of the coordinates.
    finest = max(1e-6 * float(np.abs(points).max()), 1e-30)
    enough = max(math.sqrt(0.5 * limit), 1.0) * spacing  # contains 1.5 times the wanted points on average
    return max(distance if distance < 1.5 * enough else enough, 0.5 * spacing, finest)
