# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that is known among strands before anybody looks at them, in which short paths end.

Light after a few events hardly depends on the azimuth that it is seen from. Parallel strands keep its inclination for
long. So a ratio to even light is known for each voxel and a few inclinations [Krivanek05] [Mueller21], by paths that
start on all strands: it is the same for any camera.
"""

import numpy as np
import warp as wp

from . import voxel_means
from .strand_grid import CELLS_A_VOXEL, StrandGrid

wp.set_module_options({"enable_backward": False, "fast_math": True})

SINES = wp.constant(6)  # inclinations that are told apart
_PRIOR = 32.0  # events that the ratio of the voxels around stands for: such light is smooth


@wp.struct
class LightCache:
    """Ratios to even light at the centers of voxels, (systems × inclinations, Z Y X)."""

    corner: wp.vec3
    voxel: wp.vec3
    shape: wp.vec3i
    ratios: wp.array2d[wp.vec3]
    systems: wp.array[int]  # of strands
    events: int  # on strands that a path has before it ends in the cache; below zero: none


@wp.func
def layer_at(cache: LightCache, strand: int, sine: float):
    """The layer of light that goes out from a strand, by the sine of its inclination."""
    return cache.systems[strand] * SINES + wp.clamp(int(0.5 * (sine + 1.0) * float(SINES)), 0, SINES - 1)


@wp.func
def cached(cache: LightCache, strand: int, sine: float, position: wp.vec3):
    """The ratio of light that goes out from a strand at a place, linear between inclinations."""
    at = wp.clamp(0.5 * (sine + 1.0) * float(SINES) - 0.5, 0.0, float(SINES - 1))
    low = wp.min(int(at), SINES - 2)
    part = at - float(low)
    system = cache.systems[strand]
    first = _in_layer(cache, system * SINES + low, position)
    return (1.0 - part) * first + part * _in_layer(cache, system * SINES + low + 1, position)


@wp.func
def _in_layer(cache: LightCache, layer: int, position: wp.vec3):
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
        found += share * cache.ratios[layer, (cell[2] * cache.shape[1] + cell[1]) * cache.shape[0] + cell[0]]
    return found


def none(grid: StrandGrid) -> LightCache:
    """A `LightCache` that no path ends in."""
    cache = LightCache()
    cache.systems, cache.events = wp.array(grid.systems, dtype=int), -1
    cache.ratios = wp.zeros((1, 1), dtype=wp.vec3)
    return cache


def of(grid: StrandGrid, sums: np.ndarray, count: int, events: int) -> LightCache:
    """The `LightCache` of sums (layers, Z, Y, X, 6) over a number of events: RGB, their light and that of even light.

    events: that paths have on strands before they end in it.
    """
    cache = none(grid)
    shares = sums[..., 3:].sum(axis=(1, 2, 3, 4)) / max(float(sums[..., 3:].sum()), 1e-30)
    ratios = np.stack(
        [
            voxel_means.smooth_ratios(layer, count * share, grid.origin, _PRIOR)
            for layer, share in zip(sums, shares, strict=True)
        ]
    )
    cache.corner, cache.voxel = wp.vec3(*grid.corner.tolist()), wp.vec3(*(grid.cell * CELLS_A_VOXEL).tolist())
    cache.shape, cache.events = wp.vec3i(*grid.voxels), events
    cache.ratios = wp.array(ratios.reshape(len(sums), -1, 3).astype(np.float32), dtype=wp.vec3)
    return cache
