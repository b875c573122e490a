# SPDX-License-Identifier: GPL-3.0-or-later
"""Centroidal Voronoi tessellation of a surface: Lloyd's relaxation of roots  [Du99], [Report12] section 2.3.

The cell V_i of a site s_i is the part of the surface that is nearer to it than to any other, straight through space.
With a density rho, the energy is E = sum_i ∫_{V_i} rho(x) |x - s_i|² dA. Given the sites, the nearest one is every
point's best. Given the cells, the surface point nearest to a cell's centroid c is its best site, exactly: the cell's
share of E is its share with c as the site plus mass × |s_i - c|². So E never rises.

Where E is least, areas of cells go with rho^(-1/2) [Gersho79]. Sites are to go with the density D that an artist
painted, so rho = D².

Integrals are sums over small pieces of triangles. All is computed with the surface scaled to unit size.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from . import hash_grid
from .mesh import SurfacePoints, TriMesh, interpolate, positions
from .sampling import check_density, corner_masses
from .surface_query import SurfaceQuery

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

PIECES_PER_SITE = 256
MOST_PIECES = 400_000  # unless the mesh has more triangles: each is a piece at least
SITES_AROUND = 16  # how many neighbours of a site (itself among them) are looked at before all sites are
EVERYWHERE = 4.0  # a distance that reaches across a surface of unit size

# Sites are moved past their centroids, by less than twice the way, which saves half of the iterations [Du06].
OVER_RELAXATION = 1.9

# Second moment of a regular hexagon about its centre by its area squared: no tessellation of the plane has less.
HEXAGON_MOMENT = 5.0 / (18.0 * np.sqrt(3.0))


@dataclass(frozen=True)
class Relaxation:
    """sites: `SurfacePoints`; energies (iterations + 1,) [m⁴]: before the first iteration and after each."""

    sites: SurfacePoints
    energies: np.ndarray


@dataclass(frozen=True)
class Quality:
    """How even a distribution is: 1 and 0 for an endless flat honeycomb.

    relative_energy: E by that of n regular hexagons with equal shares of ∫ D dA, HEXAGON_MOMENT (∫ D dA)² / n;
    share_variation: standard deviation by mean of the cells' shares of ∫ D dA.
    """

    relative_energy: float
    share_variation: float


def relax(mesh, sites, iterations, density=None, device="cpu"):
    """Move sites (`SurfacePoints` on a checked `TriMesh`) until they are evenly placed for a density (V,) ≥ 0.

    Sites stay on the surface, and where the density is above zero if they began there. Returns a `Relaxation`.
    """
    pieces = _Pieces(mesh, density, len(sites) * PIECES_PER_SITE, device)
    ground = _Ground(pieces.mesh, pieces.density, device)
    energies = np.empty(iterations + 1)
    for iteration in range(iterations):
        places = positions(pieces.mesh, sites)
        energies[iteration] = pieces.assign(places)
        # The last iteration ends at the centroids, so that nothing is left swinging about them.
        reach = 1.0 if iteration == iterations - 1 else OVER_RELAXATION
        sites = ground.move(sites, places, pieces.centroids(places), reach)
    energies[iterations] = pieces.assign(positions(pieces.mesh, sites))
    return Relaxation(sites, energies * pieces.size**4)


def measure(mesh, sites, density=None, device="cpu"):
    """`Quality` of sites on a checked mesh for a density (V,) or None, on finer pieces than `relax` has."""
    pieces = _Pieces(mesh, density, 4 * len(sites) * PIECES_PER_SITE, device)
    energy = pieces.assign(positions(pieces.mesh, sites))
    shares = np.bincount(pieces.cells.numpy(), weights=pieces.amounts, minlength=len(sites))
    hexagons = HEXAGON_MOMENT * shares.sum() ** 2 / len(sites)
    return Quality(energy / hexagons, float(shares.std() / shares.mean()))


class _Pieces:
    """The surface cut into small pieces, each of which belongs as a whole to the cell of its nearest site.

    mesh: the `TriMesh` scaled to unit size, `size` [m] being its own; density: D (V,); centres: (Q, 3) float32;
    amounts (Q,): ∫ D dA; masses (Q,): ∫ rho dA; cells (Q,): index of the site, once there are sites.
    """

    def __init__(self, mesh, density, piece_count, device):
        self.density = check_density(mesh, density)
        lowest, highest = mesh.corners.min(axis=(0, 1)), mesh.corners.max(axis=(0, 1))
        self.size = float((highest - lowest).max())
        self.mesh = TriMesh(((mesh.vertices - lowest) / self.size).astype(np.float32), mesh.triangles)
        points, self.amounts = _cut(self.mesh, self.density, min(piece_count, MOST_PIECES))
        self.centres = positions(self.mesh, points)
        self.masses = self.amounts * interpolate(self.density, self.mesh, points)
        self.cells = None
        self._points = wp.array(self.centres, dtype=wp.vec3, device=device)
        self._squares = wp.empty(len(points), dtype=float, device=device)

    def assign(self, places):
        """Give each piece to the nearest of the sites at places (n, 3); returns the energy."""
        sites = wp.array(places, dtype=wp.vec3, device=self._points.device)
        if self.cells is None:
            nearest, _ = hash_grid.neighbours(sites, self._points, EVERYWHERE, 1)
            self.cells = nearest.flatten()
        around, apart = hash_grid.neighbours(sites, sites, EVERYWHERE, min(SITES_AROUND, len(places)))
        wp.launch(
            _nearest_sites,
            dim=len(self._points),
            inputs=[self._points, sites, around, apart],
            outputs=[self.cells, self._squares],
            device=self._points.device,
        )
        return float(self.masses @ self._squares.numpy())

    def centroids(self, places):
        """(n, 3) float64; that of an empty cell is its site. Summed in order on the host: the same on every device."""
        cells = self.cells.numpy()
        masses = np.bincount(cells, weights=self.masses, minlength=len(places))
        sums = [np.bincount(cells, weights=self.masses * axis, minlength=len(places)) for axis in self.centres.T]
        filled = (masses > 0.0)[:, None]
        return np.where(filled, np.stack(sums, axis=1) / np.where(filled, masses[:, None], 1.0), places)


class _Ground:
    """The part of a surface where sites may be: triangles with an area and some density."""

    def __init__(self, mesh, density, device):
        self.mesh, self.density = mesh, density
        self._query = SurfaceQuery(mesh, np.flatnonzero(corner_masses(mesh, density).any(axis=1)), device)

    def move(self, sites, places, centroids, reach):
        """Sites at places (n, 3) moved `reach` times the way to their centroids (n, 3), or just to these.

        A cell's cost is mass × |s - c|². A site moves only to where that is less than at its old place: far beyond the
        centroid it need not be where the surface bends.
        """
        squares = np.sum((places - centroids) ** 2, axis=1)
        for target in (centroids, places + reach * (centroids - places)):
            moved = self._query.nearest(target)
            better = np.sum((positions(self.mesh, moved) - centroids) ** 2, axis=1) < squares
            better &= interpolate(self.density, self.mesh, moved) > 0.0
            sites = SurfacePoints(
                np.where(better, moved.triangle, sites.triangle),
                np.where(better[:, None], moved.barycentric, sites.barycentric),
            )
        return sites


def _cut(mesh, density, piece_count):
    """A mesh in about `piece_count` pieces that have an amount: their centres (`SurfacePoints`) and ∫ D dA of each.

    A triangle becomes m² equal ones, m following from the amount on it.
    """
    amounts = corner_masses(mesh, density).sum(axis=1)
    sides = np.maximum(np.round(np.sqrt(amounts * (piece_count / amounts.sum()))), 1.0).astype(int)
    sides[amounts == 0.0] = 0
    triangles, barycentric, areas = [], [], []
    for side in np.unique(sides[sides > 0]):
        whole = np.flatnonzero(sides == side)
        i, j = np.indices((side, side)).reshape(2, -1)
        upright, upended = i + j < side, i + j < side - 1
        first = np.concatenate([i[upright] + 1 / 3, i[upended] + 2 / 3]) / side
        second = np.concatenate([j[upright] + 1 / 3, j[upended] + 2 / 3]) / side
        triangles.append(np.repeat(whole, side**2))
        barycentric.append(np.tile(np.stack([first, second, 1.0 - first - second], axis=1), (len(whole), 1)))
        areas.append(np.repeat(mesh.areas[whole] / side**2, side**2))
    centres = SurfacePoints(np.concatenate(triangles).astype(np.int32), np.concatenate(barycentric).astype(np.float32))
    return centres, np.concatenate(areas) * interpolate(density, mesh, centres)


@wp.kernel
def _nearest_sites(
    points: wp.array[wp.vec3],
    sites: wp.array[wp.vec3],
    around: wp.array2d[int],
    apart: wp.array2d[float],
    # outputs; cells hold the sites to begin with, any at all
    out_cells: wp.array[int],
    out_squares: wp.array[float],
):
    piece = wp.tid()
    position = points[piece]
    nearest = out_cells[piece]
    distance = wp.length(sites[nearest] - position)
    # From one site to a nearer one around it, as long as there is any. Sites more than twice as far from this site as
    # the piece is are farther from the piece than this site [Elkan03].
    slot = int(0)
    searching = bool(True)
    while searching:
        site = nearest
        limit = 2.0 * distance
        slot = int(0)
        while slot < around.shape[1] and apart[site, slot] <= limit:
            other_distance = wp.length(sites[around[site, slot]] - position)
            if other_distance < distance:
                nearest = around[site, slot]
                distance = other_distance
            slot += 1
        searching = nearest != site
    if slot == around.shape[1] and slot < sites.shape[0]:  # the neighbours known do not reach that far
        for other in range(sites.shape[0]):
            other_distance = wp.length(sites[other] - position)
            if other_distance < distance:
                nearest = other
                distance = other_distance
    out_cells[piece] = nearest
    out_squares[piece] = distance * distance
