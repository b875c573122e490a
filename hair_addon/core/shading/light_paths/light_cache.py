# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that is known among strands before anybody looks at them, in which short paths end.

Light after a few events hardly depends on where it is seen from: of each voxel a ratio to even light is enough
[Krivanek05] [Mueller21]. It is known by paths that start on all strands, so it is the same for any camera.
"""

import numpy as np
import warp as wp

from . import voxel_means
from .strand_grid import CELLS_A_VOXEL

wp.set_module_options({"enable_backward": False, "fast_math": True})

_PRIOR = 64.0  # events that the ratio of the voxels around stands for: such light is smooth


@wp.struct
class Cache:
    """Ratios to even light at the centers of voxels, (systems, Z Y X)."""

    corner: wp.vec3
    voxel: wp.vec3
    shape: wp.vec3i
    ratios: wp.array2d[wp.vec3]
    systems: wp.array[int]  # of strands
    events: int  # on strands that a path has before it ends in the cache; below zero: none


@wp.func
def cached(cache: Cache, system: int, position: wp.vec3):
    """The ratio at a place, linear between voxels."""
    at = wp.cw_div(position - cache.corner, cache.voxel) - wp.vec3(0.5, 0.5, 0.5)
    low = wp.vec3i(0, 0, 0)
    high = wp.vec3i(0, 0, 0)
    part = wp.vec3(0.0, 0.0, 0.0)
    for axis in range(3):
        most = cache.shape[axis] - 1
        low[axis] = wp.clamp(int(wp.floor(at[axis])), 0, most)
        high[axis] = wp.min(low[axis] + 1, most)
        part[axis] = wp.clamp(at[axis] - float(low[axis]), 0.0, 1.0)
    found = wp.vec3(0.0, 0.0, 0.0)
    for corner in range(8):
        cell = low
        share = float(1.0)
        for axis in range(3):
            if (corner >> axis) % 2 == 1:
                cell[axis] = high[axis]
                share = share * part[axis]
            else:
                share = share * (1.0 - part[axis])
        found += share * cache.ratios[system, (cell[2] * cache.shape[1] + cell[1]) * cache.shape[0] + cell[0]]
    return found


def none(grid):
    """A `Cache` that no path ends in."""
    cache = Cache()
    cache.systems, cache.events = wp.array(grid.systems, dtype=int), -1
    cache.ratios = wp.zeros((1, 1), dtype=wp.vec3)
    return cache


def of(grid, sums, count, events):
    """The `Cache` of sums (systems, Z, Y, X, 6) over a number of events: their light RGB, and that of even light."""
    cache = none(grid)
    ratios = np.stack([voxel_means.smooth_ratios(of_hair, count, grid.origin, _PRIOR) for of_hair in sums])
    cache.corner, cache.voxel = wp.vec3(*grid.corner.tolist()), wp.vec3(*(grid.cell * CELLS_A_VOXEL).tolist())
    cache.shape, cache.events = wp.vec3i(*grid.voxels), events
    cache.ratios = wp.array(ratios.reshape(len(sums), -1, 3).astype(np.float32), dtype=wp.vec3)
    return cache
