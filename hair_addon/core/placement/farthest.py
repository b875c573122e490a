# SPDX-License-Identifier: GPL-3.0-or-later
"""Farthest-point sampling: each point is the farthest from all previous points [Gonzalez85].

The steps are sequential, and therefore run on the CPU, with eight points at once in vector registers.
"""

import numpy as np
import warp as wp

from ..geometry.mesh import SurfacePoints, positions
from ..kernels import kernel_cache, native_code
from .domain import Domain

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

LANES = 8


def farthest(domain: Domain, points: SurfacePoints, squares: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return indices of `SurfacePoints` of a `Domain`, each farthest from all sites and previous points.

    squares (Q,): squared distances from sites, which are weighted by the density; wanted (islands,): number of points
    of each island. Fewer are returned if the points do not suffice.
    """
    count = len(points)
    islands, densities = domain.islands[points.triangle], domain.density_at(points)
    widths = np.where(wanted[islands] > 0, squares * densities, -1.0)
    known = np.zeros((8, -(-count // LANES) * LANES), np.float32)
    known[0:3, :count] = positions(domain.mesh, points).T
    known[3:6, :count] = domain.normals[points.triangle].T
    known[6, :count], known[7] = densities, -1.0
    known[7, :count] = widths
    found = np.full(min(count, int(wanted.sum())), -1, np.int32)
    its_islands = np.full(known.shape[1], -1, np.int32)
    its_islands[:count] = islands
    arrays = (known, float), (its_islands, int), (wanted.astype(np.int32), int), (found, int)
    shared = [wp.array(values, dtype=kind, device="cpu", copy=False) for values, kind in arrays]
    kernel_cache.launch(_take_farthest, 1, shared, device="cpu")
    return found[found >= 0]


@wp.func_native(native_code.body(__file__, "farthest.cpp", LANES=LANES))
def _take(known: wp.array2d[float], islands: wp.array[int], wanted: wp.array[int], found: wp.array[int]): ...


@wp.kernel
def _take_farthest(
    known: wp.array2d[float],
    islands: wp.array[int],
    wanted: wp.array[int],
    # outputs
    found: wp.array[int],
):
    _take(known, islands, wanted, found)
