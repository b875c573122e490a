# SPDX-License-Identifier: GPL-3.0-or-later
"""Points near a place: the sorted spatial hash of [Report12] section 2.4 [Teschner03], as `wp.HashGrid` builds it.

Warp's grid visits all 27 cells around a query and each cell once (the report's 26 leave out the query's own).
"""

import math

import numpy as np
import warp as wp

from . import cores
from .cores import Rows
from .errors import HairError

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

GRID_SIZE = 32  # cells along each axis; farther ones wrap around and share a bucket, which costs time, never truth
CELLS_PER_RADIUS = 2.0  # cell width / first search radius: fewer cells to visit beats fewer points to compare
CELL_WIDTH = 0.6  # of the cells that queries are sorted by / first search radius
CELLS_ALONG = 1024  # of those cells, at most, along each axis
CANDIDATE_LIMIT = 128  # points that the queries of one cell share
candidate_indices = wp.types.vector(length=CANDIDATE_LIMIT, dtype=int)
candidate_values = wp.types.vector(length=CANDIDATE_LIMIT, dtype=float)
LIMIT = 64  # points that a query finds, at most
key_list = wp.types.vector(length=LIMIT, dtype=wp.uint64)
NO_KEY = wp.constant(wp.uint64(2**64 - 1))
QUERIES_AT_ONCE = 8  # of a cell, in vector registers
SLOTS_AT_ONCE = 9
SHORT = -2  # in place of the nearest point's index: nearer points were too few, and it takes a wider search
WIDENINGS = 3  # doublings of the search radius before all points are read instead


@wp.func
def key_of(squared: float, point: int):
    """A number that sorts as a squared distance, and then as an index: bits of floats that are not negative do."""
    return wp.bit_or(wp.lshift(wp.uint64(wp.cast(squared, dtype=wp.uint32)), wp.uint64(32)), wp.uint64(point))


@wp.func
def point_of(key: wp.uint64):
    """The index in a key."""
    return int(wp.bit_and(key, wp.uint64(0xFFFFFFFF)))


@wp.func
def square_of(key: wp.uint64):
    """The squared distance in a key."""
    return wp.cast(wp.uint32(wp.rshift(key, wp.uint64(32))), dtype=float)


@wp.func
def _inserted(nearest: key_list, key: wp.uint64, limit: int):
    """Keys with another one in its place, the last of them dropped; without a branch that nobody could foretell."""
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
    """Keys of a search that goes wider until they are enough, or the whole distance was searched and held something."""
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
        # What is out of reach does not count, except for the very nearest.
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
    # outputs
    out_cells: wp.array[int],
):
    query = wp.tid()
    cell = int(0)
    for axis in range(3):
        along = wp.clamp(per_width * (queries[query][axis] - low[axis]), 0.0, float(CELLS_ALONG - 1))
        cell = CELLS_ALONG * cell + int(along)
    out_cells[query] = cell


_RANKING = f"""
#if !defined(__CUDA_ARCH__)
  typedef float floats __attribute__((ext_vector_type({QUERIES_AT_ONCE})));
  typedef double keys __attribute__((ext_vector_type({QUERIES_AT_ONCE})));
  typedef long long bits __attribute__((ext_vector_type({QUERIES_AT_ONCE})));
  const float infinite = __builtin_inff();
  const int limit = out_indices.shape[1];
  const float reach = first_radius * first_radius;
  for (int begin = first; begin < end; begin += {QUERIES_AT_ONCE}) {{
    const int count = end - begin < {QUERIES_AT_ONCE} ? end - begin : {QUERIES_AT_ONCE};
    floats x, y, z;
    for (int lane = 0; lane < {QUERIES_AT_ONCE}; ++lane) {{
      const auto& query = queries.data[order.data[begin + (lane < count ? lane : 0)]];
      x[lane] = query[0];
      y[lane] = query[1];
      z[lane] = query[2];
    }}
    keys nearest[{LIMIT}];
    // Some slots at a time, in registers: what falls out of the last of them is handed on to the next.
    keys handed[{CANDIDATE_LIMIT}];
    for (int candidate = 0; candidate < candidate_count; ++candidate) {{
      const floats away_x = candidates_x[candidate] - x;
      const floats away_y = candidates_y[candidate] - y;
      const floats away_z = candidates_z[candidate] - z;
      const floats apart = away_x * away_x + away_y * away_y + away_z * away_z;
      // A float leaves 29 bits of a double free: room for which it is, and so for who comes first of two as far.
      const bits key = __builtin_bit_cast(bits, __builtin_convertvector(apart, keys)) | candidate;
      handed[candidate] = __builtin_bit_cast(keys, key);
    }}
    for (int slot = 0; slot < limit; slot += {SLOTS_AT_ONCE}) {{
      keys kept[{SLOTS_AT_ONCE}];
      for (int i = 0; i < {SLOTS_AT_ONCE}; ++i) kept[i] = keys(__builtin_inf());
      for (int candidate = 0; candidate < candidate_count; ++candidate) {{
        keys key = handed[candidate];
        #pragma unroll
        for (int i = 0; i < {SLOTS_AT_ONCE}; ++i) {{
          const keys other = kept[i];
          kept[i] = key < other ? key : other;
          key = key < other ? other : key;
        }}
        handed[candidate] = key;
      }}
      for (int i = 0; i < {SLOTS_AT_ONCE} && slot + i < limit; ++i) nearest[slot + i] = kept[i];
    }}
    for (int lane = 0; lane < count; ++lane) {{
      const size_t row = size_t(order.data[begin + lane]) * limit;
      int found_count = 0;
      for (int slot = 0; slot < limit; ++slot) {{
        const double key = nearest[slot][lane];
        const float squared = key;
        const float apart = __builtin_sqrtf(squared);
        const bool is_near = squared < reach;
        found_count += is_near;
        // What is out of reach does not count, except for the very nearest.
        const bool is_found = is_near && (slot == 0 || apart < distance);
        const int candidate = __builtin_bit_cast(long long, key) & {CANDIDATE_LIMIT - 1};
        out_indices.data[row + slot] = is_found ? candidates[candidate] : -1;
        out_distances.data[row + slot] = is_found ? apart : infinite;
      }}
      if (found_count < limit && (first_radius < distance || found_count == 0)) out_indices.data[row] = {SHORT};
    }}
  }}
#endif
"""


@wp.func_native(_RANKING)
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
    # All points in reach of any query of the cell, by rising index: found once, compared with each.
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


def neighbours(points, queries, distance, limit):
    """The points nearer to each query than a distance, at most `limit` of them, and never none.

    points (N,) and queries (Q,) are vec3 arrays [m] on one device, N > 0; distance [m]. Returns indices (Q, limit)
    int32 and distances (Q, limit) float32 [m] there, every row sorted by distance and then by index, unused slots
    holding -1 and infinity. A query with no point in reach gets the nearest one alone.
    """
    if not (math.isfinite(distance) and distance > 0.0):  # also refuses NaN, which wp.HashGrid does not
        raise HairError(f"The distance to search must be positive and finite, not {distance:g} m.")
    if len(points) == 0:
        raise HairError("There are no guides to follow: distribute guides first.")
    if limit > LIMIT:
        raise ValueError(f"at most {LIMIT} neighbours can be found, not {limit}")
    device = points.device
    indices = wp.empty((len(queries), limit), dtype=int, device=device)
    distances = wp.empty((len(queries), limit), dtype=float, device=device)
    first_radius = _first_radius(points.numpy(), distance, limit)
    grid = wp.HashGrid(GRID_SIZE, GRID_SIZE, GRID_SIZE, device=device)
    grid.build(points, CELLS_PER_RADIUS * first_radius)
    by = by_cells if device.is_cpu else by_queries
    by(points, queries, grid, distance, first_radius, indices, distances)
    return indices, distances


def by_queries(points, queries, grid, distance, first_radius, out_indices, out_distances):
    """Fill the rows of `neighbours`, each query on its own: the GPU's way."""
    wp.launch(
        _by_queries,
        dim=len(queries),
        inputs=[points, queries, grid.id, distance, first_radius],
        outputs=[out_indices, out_distances],
        device=points.device,
    )


def by_cells(points, queries, grid, distance, first_radius, out_indices, out_distances):
    """Fill the rows of `neighbours`, all queries of a cell together: the processor's way, twice as fast there."""
    device = points.device
    order, bounds = _sorted_by_cell(points.numpy(), queries, CELL_WIDTH * first_radius)
    order, firsts, ends = (wp.array(part, dtype=int, device=device) for part in (order, bounds[:-1], bounds[1:]))
    cores.launch(
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
    """Indices (Q,) int32 of queries cell after cell, and where each cell's begin, the end included.

    Cells of a width [m] fill the box around points (N, 3); queries outside share those of its border.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    width = max(width, float((high - low).max()) / CELLS_ALONG)
    cells = wp.empty(len(queries), dtype=int, device=queries.device)
    cores.launch(
        _cells,
        len(queries),
        inputs=[Rows(queries), wp.vec3(*low.tolist()), 1.0 / width],
        outputs=[cells],
        device=queries.device,
    )
    # Sorted as one number each, cell and then query: faster than an order of indices, and what reads along them.
    pairs = (cells.numpy().astype(np.int64) << 32) | np.arange(len(queries))
    pairs.sort()
    changes = np.flatnonzero(np.diff(pairs >> 32)) + 1
    return pairs.astype(np.int32), np.concatenate([[0], changes, [len(queries)]]).astype(np.int32)


def _first_radius(points, distance, limit):
    """Radius [m] to search first: the distance, unless that holds far more points than wanted, or none as a rule."""
    extent = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    # Of points that lie on a surface; a lone one is looked for in wide cells, which are few.
    spacing = extent / math.sqrt(len(points)) if extent else distance
    # Cells narrower than the rounding of the coordinates could not tell points apart.
    finest = max(1e-6 * float(np.abs(points).max()), 1e-30)
    enough = max(math.sqrt(0.5 * limit), 1.0) * spacing  # half as many again as are wanted, on the whole
    return max(distance if distance < 1.5 * enough else enough, 0.5 * spacing, finest)
