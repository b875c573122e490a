# SPDX-License-Identifier: GPL-3.0-or-later
"""Random roots by density × area  (Eq. 6 as corrected in DECISIONS.md)."""

import numpy as np

from .errors import HairError
from .mesh import SurfacePoints


def check_density(mesh, density):
    """(V,) float64 per vertex, all one where `density` is None; `HairError` unless something grows with it."""
    if density is None:
        return np.ones(len(mesh.vertices))
    density = np.asarray(density, dtype=np.float64)
    if density.shape != (len(mesh.vertices),):
        raise HairError(
            f"The density has {density.size} values for {len(mesh.vertices)} vertices: it must have one per vertex."
        )
    bad_count = int(np.count_nonzero(~(np.isfinite(density) & (density >= 0.0))))
    if bad_count:
        raise HairError(f"The density of {bad_count} vertices is negative or not a number: it must be at least zero.")
    if not np.any(corner_masses(mesh, density) > 0.0):
        raise HairError("The density is zero on every face: paint some weight where hair should grow.")
    return density


def corner_masses(mesh, density):
    """(F, 3): the part of density × area that each corner's vertex brings to a triangle.

    Density is linear inside a triangle, so the integral over it is area × mean of its corners' densities.
    """
    return mesh.areas[:, None] / 3.0 * density[mesh.triangles]


def sample_surface(mesh, count, seed, density=None):
    """`count` random points on a mesh, as `SurfacePoints`, distributed as density × area: linear inside triangles too.

    mesh: a checked `TriMesh`; density: (V,) per vertex, at least 0, or None for uniform. The same seed gives the same
    points everywhere, and the first of many points are those that a smaller count would give.
    """
    if count <= 0:
        raise HairError(f"The number of roots must be positive, not {count}.")
    masses = corner_masses(mesh, check_density(mesh, density)).ravel()
    random = np.random.Generator(np.random.PCG64(seed)).random((count, 4))
    # Eq. 6 draws and rejects; the running sum takes every draw, and takes it to a corner of a triangle.
    running = np.cumsum(masses)
    drawn = random[:, 0] * running[-1]
    order = np.argsort(drawn)  # neighbours in the sum are looked up one after the other: half the time
    corner = np.empty(count, np.int32)
    corner[order] = np.searchsorted(running, drawn[order], side="right")
    corner = np.minimum(
        corner, np.int32(np.flatnonzero(masses)[-1])
    )  # rounding must not step past the last that has mass
    triangle, corner = np.divmod(corner, np.int32(3))
    # A corner's share of a linear density falls from it to nothing at the opposite edge: Dirichlet(2, 1, 1). That is
    # how three cuts of a unit stick divide it, if two of the four pieces go to the corner [Devroye86, chapter V].
    cuts = random[:, 1:].T.copy()
    first, last = cuts.min(axis=0), cuts.max(axis=0)
    barycentric = np.empty((count, 3), np.float32)
    rows = np.arange(count)
    barycentric[rows, (corner + 1) % 3] = first
    barycentric[rows, (corner + 2) % 3] = 1.0 - last
    barycentric[rows, corner] = last - first
    return SurfacePoints(triangle, barycentric)
