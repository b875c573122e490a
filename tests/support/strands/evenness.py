# SPDX-License-Identifier: GPL-3.0-or-later
"""Relaxation of given sites, and measures of their evenness."""

from dataclasses import dataclass

import numpy as np

from hair_addon.core.geometry.mesh import SurfacePoints
from hair_addon.core.placement import cvt
from hair_addon.core.placement.domain import Domain
from hair_addon.core.placement.exact_cells import CutCells
from hair_addon.core.placement.voronoi import sites_on

# Second moment of a regular hexagon about its center divided by its squared area: the minimum of plane tessellations.
HEXAGON_MOMENT = 5.0 / (18.0 * np.sqrt(3.0))


@dataclass(frozen=True)
class Relaxation:
    """sites: `SurfacePoints`; energies [m⁴]: before the first iteration and after each, until convergence."""

    sites: SurfacePoints
    energies: np.ndarray


@dataclass(frozen=True)
class Quality:
    """Evenness of a distribution: 1 and 0 for an infinite flat honeycomb.

    relative_energy: E divided by that of n regular hexagons with equal shares of ∫ D dA, HEXAGON_MOMENT (∫ D dA)² / n;
    share_variation: standard deviation divided by mean of the cells' shares of ∫ D dA.
    """

    relative_energy: float
    share_variation: float


def relax(mesh, sites, iterations, density=None, device="cpu", steps_kept=cvt.STEPS_KEPT):
    """Move `SurfacePoints` on a checked `TriMesh` until they are even for a density (V,) ≥ 0.

    steps_kept: 0 for Lloyd's method alone. Returns a `Relaxation`.
    """
    domain = Domain(mesh, len(sites), density, device=device)
    cells = CutCells(domain, len(sites), device)
    descent = cvt._descend(domain, cells, sites, iterations, device, lambda part: None, steps_kept=steps_kept)
    return Relaxation(descent.sites, descent.energies * domain.mass * domain.densest**2 * domain.size**4)


def measure(mesh, sites, density=None, device="cpu"):
    """Return the `Quality` of sites on a checked mesh for a density (V,) or None."""
    domain = Domain(mesh, len(sites), density, device=device)
    neighbours = sites_on(domain, sites, device)
    total = domain.amounts.sum()
    energy = CutCells(domain, len(sites), device).sums(neighbours).energy * domain.mass
    shares = CutCells(domain, len(sites), device, domain.densities / total).sums(neighbours).masses
    return Quality(energy / (HEXAGON_MOMENT * total**2 / len(sites)), float(shares.std() / shares.mean()))
