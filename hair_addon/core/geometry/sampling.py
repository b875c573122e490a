# SPDX-License-Identifier: GPL-3.0-or-later
"""Random roots by density × area  (Eq. 6 as corrected in DECISIONS.md)."""

import numpy as np
import warp as wp

from ..errors import HairError
from ..kernels import parallel
from ..kernels.parallel import Rows
from .mesh import SurfacePoints, TriMesh
from .search import counting_sort

wp.set_module_options({"enable_backward": False})


def check_density(mesh: TriMesh, density: np.ndarray | None) -> np.ndarray:
    """Return the density (V,) float64 of vertices, 1 for None. Raises `HairError` unless some mass is positive."""
    if density is None:
        return np.ones(len(mesh.vertices))
    density = np.asarray(density, dtype=np.float64)
    if density.shape != (len(mesh.vertices),):
        raise HairError(
            f"The density has {density.size} values for {len(mesh.vertices)} vertices: it must have one per vertex."
        )
    bad_count = int(np.count_nonzero(~(np.isfinite(density) & (density >= 0.0))))
    if bad_count:
        sentence = "The density of {count} vertices is negative or not a number: it must be at least zero."
        raise HairError(sentence, count=bad_count)
    if not np.any(corner_masses(mesh, density) > 0.0):
        raise HairError("The density is zero everywhere: paint weight where hair should grow.")
    return density


def corner_masses(mesh: TriMesh, density: np.ndarray) -> np.ndarray:
    """Return (F, 3): the contribution of each corner to the triangle's density × area.

    Density is linear inside a triangle, so its integral is area × mean of the corners' densities.
    """
    return mesh.areas[:, None] / 3.0 * density[mesh.triangles]


def sample_surface(mesh: TriMesh, count: int, seed: int, density: np.ndarray | None = None) -> SurfacePoints:
    """Return `count` random `SurfacePoints` distributed as density × area, with density linear inside triangles.

    mesh: a checked `TriMesh`; density: (V,) of vertices, at least 0, None for uniform. The same seed gives the same
    points on every machine; the points of a smaller count are a subset. Points are in `TriMesh.surface_order`, for
    cache locality. Raises `HairError`.
    """
    if count <= 0:
        raise HairError(f"The number of roots must be positive, not {count}.")
    masses = corner_masses(mesh, check_density(mesh, density)).ravel()
    random = np.random.Generator(np.random.PCG64(seed)).random((count, 4))
    # Eq. 6 uses rejection; inversion of the cumulative sum uses every draw, and selects a corner of a triangle.
    running = np.cumsum(masses)
    order = counting_sort.rising(random[:, 0])
    ends = np.searchsorted(random[order, 0] * running[-1], running)
    ends[np.flatnonzero(masses)[-1] :] = count  # despite rounding, no point is past the last positive mass
    corner = np.repeat(np.arange(len(masses), dtype=np.int32), np.diff(ends, prepend=0))
    along = _runs(ends[2::3], mesh.surface_order)
    triangle, barycentric = np.empty(count, np.int32), np.empty((count, 3), np.float32)
    parallel.launch(
        _cut,
        count,
        inputs=[Rows(_there(along, int)), _there(order, int), _there(corner, int), _there(random, wp.vec4d)],
        outputs=[_there(triangle, int), _there(barycentric, wp.vec3)],
        device="cpu",
    )
    return SurfacePoints(triangle, barycentric)


@wp.kernel
def _cut(
    along: wp.array[int],
    order: wp.array[int],
    corners: wp.array[int],
    random: wp.array[wp.vec4d],
    # outputs
    out_triangles: wp.array[int],
    out_barycentric: wp.array[wp.vec3],
):
    """Sample the corner's part of a linear density, which falls to zero at the opposite edge: Dirichlet(2, 1, 1).

    Three cuts divide the unit interval into four spacings, two of which go to the corner [Devroye86, chapter V].
    """
    root = wp.tid()
    corner = corners[along[root]]
    cuts = random[order[along[root]]]
    first = wp.min(wp.min(cuts[1], cuts[2]), cuts[3])
    last = wp.max(wp.max(cuts[1], cuts[2]), cuts[3])
    weights = wp.vec3()
    weights[corner % 3] = wp.float32(last - first)
    weights[(corner + 1) % 3] = wp.float32(first)
    weights[(corner + 2) % 3] = wp.float32(wp.float64(1.0) - last)
    out_triangles[root] = corner / 3
    out_barycentric[root] = weights


def _there(array, dtype):
    return wp.array(array, dtype=dtype, device="cpu", copy=False)


def _runs(ends, order):
    """Return the indices of all items, with their runs in a new order; ends: of consecutive runs; order: of runs."""
    counts = np.diff(ends, prepend=0)[order]
    return np.repeat((ends[order] - np.cumsum(counts)).astype(np.int32), counts) + np.arange(ends[-1], dtype=np.int32)
