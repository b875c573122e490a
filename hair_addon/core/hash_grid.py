# SPDX-License-Identifier: GPL-3.0-or-later
"""Points near a place: the sorted spatial hash of [Report12] section 2.4 [Teschner03], as `wp.HashGrid` builds it.

Warp's grid visits all 27 cells around a query and each cell once (the report's 26 leave out the query's own).
"""

import math

import numpy as np
import warp as wp

from .errors import HairError

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

GRID_SIZE = 32  # cells along each axis; farther ones wrap around and share a bucket, which costs time, never truth
CELLS_PER_RADIUS = 2.0  # cell width / first search radius: fewer cells to visit beats fewer points to compare
WIDENINGS = 3  # doublings of the search radius before all points are read instead


@wp.func
def _insert(point: int, distance: float, count: int, indices: wp.array[int], distances: wp.array[float]):
    """Put a point in its place among the nearest so far, by distance and then by index; returns the new count."""
    limit = indices.shape[0]
    slot = count
    if count == limit:
        slot = limit - 1
        if distance > distances[slot] or (distance == distances[slot] and point > indices[slot]):
            return count
    while slot > 0 and (
        distances[slot - 1] > distance or (distances[slot - 1] == distance and indices[slot - 1] > point)
    ):
        distances[slot] = distances[slot - 1]
        indices[slot] = indices[slot - 1]
        slot -= 1
    distances[slot] = distance
    indices[slot] = point
    return wp.min(count + 1, limit)


@wp.kernel
def _neighbours(
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
    position = queries[query]
    indices = out_indices[query]
    distances = out_distances[query]
    limit = indices.shape[0]
    count = int(0)
    radius = first_radius
    widenings = int(0)
    searching = bool(True)
    while searching and widenings <= WIDENINGS:
        count = int(0)
        for point in wp.hash_grid_query(grid, position, radius):
            apart = wp.length(points[point] - position)
            if apart < radius:
                count = _insert(point, apart, count, indices, distances)
        # Done when the row is full, or when the whole distance has been searched and held something.
        searching = count < limit and (radius < distance or count == 0)
        radius = 2.0 * radius
        widenings += 1
    if searching:
        count = int(0)
        for point in range(points.shape[0]):
            count = _insert(point, wp.length(points[point] - position), count, indices, distances)
    # What is out of reach does not count, except for the very nearest.
    while count > 1 and distances[count - 1] >= distance:
        count -= 1
    for slot in range(count, limit):
        indices[slot] = -1
        distances[slot] = wp.inf


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
    device = points.device
    indices = wp.empty((len(queries), limit), dtype=int, device=device)
    distances = wp.empty((len(queries), limit), dtype=float, device=device)
    first_radius = _first_radius(points.numpy(), distance)
    grid = wp.HashGrid(GRID_SIZE, GRID_SIZE, GRID_SIZE, device=device)
    grid.build(points, CELLS_PER_RADIUS * first_radius)
    wp.launch(
        _neighbours,
        dim=len(queries),
        inputs=[points, queries, grid.id, distance, first_radius],
        outputs=[indices, distances],
        device=device,
    )
    return indices, distances


def _first_radius(points, distance):
    """Radius [m] to search first: the distance, unless that holds nearly all points, or none as a rule."""
    extent = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    # Of points that lie on a surface; a lone one is looked for in wide cells, which are few.
    spacing = extent / math.sqrt(len(points)) if extent else distance
    # Cells narrower than the rounding of the coordinates could not tell points apart.
    finest = max(1e-6 * float(np.abs(points).max()), 1e-30)
    return max(min(distance, 2.0 * spacing), 0.5 * spacing, finest)
