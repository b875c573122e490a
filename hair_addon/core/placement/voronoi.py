# SPDX-License-Identifier: GPL-3.0-or-later
"""Restricted Voronoi cells: the parts of a surface that are nearest to each site [Yan09].

The two sides of a thin part, and separate islands, are not neighbours: there an offset is added to the squared
distance, so that the borders of cells remain planes (a power diagram).

Sums are integers, in units far below single precision: they do not depend on the order or the number of threads, so
results are bit-identical on every run.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ..geometry.hash_grid import CELLS_PER_RADIUS, NO_KEY, key_of, point_of, square_of
from ..geometry.mesh import SurfacePoints, positions
from ..kernels import parallel
from ..kernels.parallel import Rows
from .domain import Domain

# Nothing differentiates these kernels, and every device rounds as the processor does: no fused multiply-add.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

SITES_AROUND = 16  # how many neighbours of a site (itself among them) are looked at before all sites are
FIRST_RING = 7  # a site and its neighbours in a honeycomb
EVERYWHERE = 4.0  # a distance that reaches across a surface of unit size
SEARCH_RADIUS = 2.6  # by the square root of a cell's area: more than SITES_AROUND of a honeycomb
DETOUR = 2.0  # by which a site on the other side of a thin part counts as farther, in spacings of sites

UNIT = wp.constant(wp.float64(2.0**54))  # sums over a surface with a mass of one stay below 2^63

near_keys = wp.types.vector(length=SITES_AROUND, dtype=wp.uint64)


@wp.struct
class Sites:
    """Positions of sites, their sides, their neighbours, and the mean distance of the first ring of these."""

    places: wp.array[wp.vec3]
    normals: wp.array[wp.vec3]
    islands: wp.array[int]
    around: wp.array2d[int]
    apart: wp.array2d[float]
    spacings: wp.array[float]


@wp.func
def detour_of(normal: wp.vec3, island: int, detour: float, site_normal: wp.vec3, site_island: int):
    """Offset of the squared distance of a site: zero on the same side of the same island."""
    if site_island != island:
        return detour
    # None up to a right angle and some more: a sharp edge is no other side.
    return detour * wp.clamp(-1.5 * wp.dot(normal, site_normal) - 0.5, 0.0, 1.0)


@wp.func
def candidate(around: wp.array2d[int], site: int, slot: int):
    """Another site: first those around it, in order of distance, then all."""
    if slot < around.shape[1]:
        return around[site, slot]
    return slot - around.shape[1]


@wp.func
def candidate_count(around: wp.array2d[int], places: wp.array[wp.vec3]):
    """Number of slots of `candidate`."""
    if around.shape[1] < places.shape[0]:
        return around.shape[1] + places.shape[0]
    return around.shape[1]


@wp.func
def nearest_site(point: wp.vec3, normal: wp.vec3, island: int, detour: float, sites: Sites, start: int):
    """The site nearest to a point, detours included; `start` is any site, the nearer the quicker."""
    nearest = start
    square = wp.length_sq(sites.places[nearest] - point)
    square += detour_of(normal, island, detour, sites.normals[nearest], sites.islands[nearest])
    searching = bool(True)
    while searching:
        site = nearest
        # Sites farther from this one than that are farther from the point than the nearest so far [Elkan03].
        reach = wp.length(sites.places[site] - point) + wp.sqrt(square)
        slot = int(0)
        while slot < candidate_count(sites.around, sites.places):
            if slot < sites.around.shape[1]:
                if sites.apart[site, slot] > reach:
                    break
            other = candidate(sites.around, site, slot)
            other_square = wp.length_sq(sites.places[other] - point)
            if other_square < square:
                other_square += detour_of(normal, island, detour, sites.normals[other], sites.islands[other])
                if other_square < square:
                    square = other_square
                    nearest = other
                    # wp.sqrt shrinks the reach from this same site
                    reach = wp.length(sites.places[site] - point) + wp.sqrt(square)
            slot += 1
        searching = nearest != site
    return nearest


@wp.func
def fixed(value: float):
    return wp.int64(wp.float64(value) * UNIT)


@dataclass(frozen=True)
class Sums:
    """Of every cell: masses (n,), moments (n, 3) of its places about its site, energies (n,); all float64.

    spacing: (n,) distance from a site to the next, infinite for one alone.
    """

    masses: np.ndarray
    moments: np.ndarray
    energies: np.ndarray
    spacing: np.ndarray

    @property
    def energy(self) -> float:
        """The energy of all cells."""
        return float(self.energies.sum())


def sites_on(domain: Domain, points: SurfacePoints, device: wp.DeviceLike) -> Sites:
    """`Sites` at `SurfacePoints` of a `Domain`."""
    sites = Sites()
    sites.places = wp.array(positions(domain.mesh, points), dtype=wp.vec3, device=device)
    sites.normals = wp.array(domain.normals[points.triangle], dtype=wp.vec3, device=device)
    sites.islands = wp.array(domain.islands[points.triangle], dtype=int, device=device)
    shape = (len(points), min(SITES_AROUND, len(points)))
    sites.around = wp.empty(shape, dtype=int, device=device)
    sites.apart = wp.empty(shape, dtype=float, device=device)
    sites.spacings = wp.empty(len(points), dtype=float, device=device)
    radius = SEARCH_RADIUS * float(np.sqrt(domain.parts.areas.sum() / len(points)))
    domain.grid.build(sites.places, CELLS_PER_RADIUS * radius)
    parallel.launch(
        _find_around,
        len(points),
        inputs=[Rows(sites.places), sites.places, domain.grid.id, radius],
        outputs=[sites.around, sites.apart, sites.spacings],
        device=device,
        least_rows=512,
    )
    return sites


def some_sites(domain: Domain, sites: Sites, points: wp.array[wp.vec3]) -> wp.array[int]:
    """(Q,) int Warp array: a site that is not far from each point, for a search to begin with."""
    found = wp.empty(len(points), dtype=int, device=points.device)
    radius = float(np.sqrt(domain.parts.areas.sum() / len(sites.places)))
    inputs = [sites, Rows(points), domain.grid.id, radius]
    parallel.launch(_some_site, len(points), inputs, outputs=[found], device=points.device)
    return found


def detours(domain: Domain, densities: np.ndarray, site_count: int) -> np.ndarray:
    """(Q,) squared: how much farther a site on the other side counts, twice the spacing that sites have there."""
    areas = domain.amounts.sum() / (site_count * densities)
    return np.minimum(DETOUR**2 * areas, EVERYWHERE**2)


def sum_cells(
    kernel: wp.Kernel, count: int, inputs: list[Any], outputs: list[wp.array], sites: Sites, device: wp.DeviceLike
) -> Sums:
    """`Sums` of a kernel that adds to the masses, moments and energies of cells; every thread adds up its own."""
    site_count = len(sites.places)
    shapes = (site_count, (site_count, 3), site_count)
    sums = [
        [wp.zeros(shape, dtype=wp.int64, device=device) for shape in shapes]
        for _ in range(parallel.share_count(count, device))
    ]
    parallel.launch_shares(kernel, count, inputs, [[*outputs, *own] for own in sums], device)
    masses, moments, energies = (
        np.sum([array.numpy() for array in arrays], axis=0) / float(UNIT) for arrays in zip(*sums, strict=True)
    )
    spacing = sites.apart.numpy()[:, 1] if site_count > 1 else np.full(1, np.inf)
    return Sums(masses, moments, energies, spacing)


@wp.kernel
def _some_site(
    sites: Sites,
    points: wp.array[wp.vec3],
    grid: wp.uint64,
    first_radius: float,
    # outputs
    out_sites: wp.array[int],
):
    point = wp.tid()
    place = points[point]
    found = int(-1)
    nearest = float(wp.inf)
    radius = first_radius
    while found < 0:
        for site in wp.hash_grid_query(grid, place, radius):
            apart = wp.length_sq(sites.places[site] - place)
            # The order of a grid's points is not the same everywhere.
            if apart < nearest or (apart == nearest and site < found):
                nearest = apart
                found = site
        radius = 2.0 * radius
    out_sites[point] = found


@wp.kernel
def _find_around(
    own_places: wp.array[wp.vec3],
    places: wp.array[wp.vec3],
    grid: wp.uint64,
    first_radius: float,
    # outputs
    out_around: wp.array2d[int],
    out_apart: wp.array2d[float],
    out_spacings: wp.array[float],
):
    site = wp.tid()
    limit = out_around.shape[1]
    place = own_places[site]
    nearest = near_keys()
    radius = first_radius
    count = int(0)
    while count < limit:
        nearest = near_keys(NO_KEY)
        count = int(0)
        for other in wp.hash_grid_query(grid, place, radius):
            square = wp.length_sq(places[other] - place)
            if square <= radius * radius:
                key = key_of(square, other)
                # Insert in order and drop the last, without an unpredictable branch.
                for slot in range(wp.static(SITES_AROUND)):
                    kept = nearest[slot]
                    nearest[slot] = wp.min(kept, key)
                    key = wp.max(kept, key)
                count += 1
        radius = 1.5 * radius
    ring = wp.min(FIRST_RING, limit)
    total = float(0.0)
    for slot in range(limit):
        apart = wp.sqrt(square_of(nearest[slot]))
        out_around[site, slot] = point_of(nearest[slot])
        out_apart[site, slot] = apart
        if slot > 0 and slot < ring:
            total += apart
    out_spacings[site] = total / float(wp.max(ring - 1, 1))
