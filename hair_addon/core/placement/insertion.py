# SPDX-License-Identifier: GPL-3.0-or-later
"""Insertion of sites between fixed sites: farthest points, then Lloyd's relaxation of the new sites alone.

The energy is the same as in cvt.py, and includes the cells of fixed sites.
"""

import numpy as np

from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from .domain import Domain
from .farthest import farthest
from .sampled_cells import SampledCells
from .voronoi import sites_on

SAMPLES_PER_SITE = 64
LEAST_SAMPLES = 4000
ROUNDS = 30  # at most
ENOUGH = 1e-3  # largest step at convergence, relative to the spacing of sites


def insert(
    mesh: TriMesh,
    fixed: SurfacePoints,
    count: int,
    *,
    density: np.ndarray | None = None,
    texture: Texture | None = None,
    around: np.ndarray | None = None,
    within: np.ndarray | None = None,
    device: str = "cpu",
) -> SurfacePoints:
    """Return `count` new sites, as `SurfacePoints`, placed evenly between at least one `fixed` site.

    mesh: a checked `TriMesh`; density (V,) and texture as in `cvt.place`; around: (F,) bool, fixed sites to which new
    ones may be nearest, None for all; within: (F,) [m], largest distance of new sites from each fixed site before
    relaxation, None for no limit. Fewer sites are returned if there is no room. Deterministic. Raises `HairError` if
    the density is zero everywhere.
    """
    total = len(fixed) + count
    domain = Domain(mesh, total, density, texture, None, device)
    points, part = domain.samples(max(SAMPLES_PER_SITE * total, LEAST_SAMPLES))
    cells = SampledCells(domain, points, part, total, device)
    nearest = cells.nearest(sites_on(domain, fixed, device))
    squares = np.sum((cells.places - positions(domain.mesh, fixed)[nearest]) ** 2, axis=1)
    may_hold = np.ones(len(points), bool) if around is None else np.asarray(around)[nearest]
    if within is not None:
        may_hold &= np.sqrt(squares) * domain.size <= np.asarray(within)[nearest]
    candidates = points[may_hold]
    if not len(candidates) or not count:
        return points[:0]
    wanted = _shares(domain, fixed, nearest, may_hold, points, count)
    new = candidates[farthest(domain, candidates, squares[may_hold], wanted)]
    if not may_hold.all():  # cells end at the border of `may_hold`, which keeps new sites inside
        cells = SampledCells(domain, candidates, part[may_hold], total, device)
    for _ in range(ROUNDS if len(new) else 0):
        on = sites_on(domain, fixed.joined(new), device)
        sums = cells.sums(on)
        masses, moments = sums.masses[len(fixed) :, None], sums.moments[len(fixed) :]
        steps = np.where(masses > 0.0, moments / np.where(masses > 0.0, masses, 1.0), 0.0)
        new = domain.moved(new, positions(domain.mesh, new) + steps)
        if np.linalg.norm(steps, axis=1).max() < ENOUGH * float(np.median(sums.spacing)):
            break
    return new


def _shares(domain, fixed, nearest, may_hold, points, count):
    """Return (islands,) the number of new sites of each island: its share by samples minus its fixed sites."""
    island_count = int(domain.islands.max()) + 1
    amounts = np.bincount(domain.islands[points.triangle[may_hold]], minlength=island_count).astype(float)
    is_there = np.zeros(len(fixed), bool)
    is_there[nearest[may_hold]] = True
    present = np.bincount(domain.islands[fixed.triangle[is_there]], minlength=island_count)
    total = present.sum() + count
    lacking = np.maximum(amounts / amounts.sum() * total - present, 0.0) * (amounts > 0)
    ends = np.round(np.cumsum(lacking) * (count / max(lacking.sum(), 1e-30)))
    return np.diff(ends, prepend=0.0).astype(int)
