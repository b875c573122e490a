# SPDX-License-Identifier: GPL-3.0-or-later
"""Restricted Voronoi cells: the parts of a surface that are nearest to each site [Yan09].

The two sides of a thin part, and separate islands, are not neighbors: between them an offset is added to the squared
distance, so that the borders of cells remain planes (a power diagram).

Sums are integers, in units far below single precision, and thus independent of the order and number of threads: results
are bit-identical on every run.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ..geometry.mesh import SurfacePoints, positions
from ..geometry.search.hash_grid import CELLS_PER_RADIUS, NO_KEY, key_of, point_of, square_of
from ..kernels import parallel
from ..kernels.parallel import Rows
from .domain import Domain

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

SITES_AROUND = 16  # neighbors of a site, itself included, found in one search
MOST_AROUND = 48  # neighbors before a search of all sites: a thin part has neighbors on its other side too
ENOUGH_AROUND = 12  # neighbors on the site's own side
FIRST_RING = 6  # neighbors in a honeycomb
MOST_FAR = 256  # maximum number of sites in the disk or ball around a site, searched before all sites
FAR = 1.7  # radius of the search for them, in distances of the last neighbor
FAR_MARGIN = 1.01  # factor of this radius, against rounding
FARTHEST = 4.0  # largest radius, in radii of the search for neighbors: larger ones visit too many cells of the grid
EVERYWHERE = 4.0  # a distance larger than a surface of unit size
SEARCH_RADIUS = 2.6  # relative to the square root of a cell's area: contains more than SITES_AROUND of a honeycomb
DETOUR = 2.0  # added distance of a site on the other side of a thin part, in spacings of sites

UNIT = wp.constant(wp.float64(2.0**54))  # sums over a surface with a mass of one stay below 2^63

_FIRST_FAR = MOST_AROUND + 1  # slots of candidates: neighbors, then far sites or all sites
_FIRST_OF_ALL = _FIRST_FAR + MOST_FAR

near_keys = wp.types.vector(length=SITES_AROUND, dtype=wp.uint64)


@wp.struct
class Sites:
    """Positions of sites, their normals and islands, and `counts` neighbors of each in order of distance.

    gaps: distance of the nearest neighbor on the site's own side; spacings: mean distance of the first ring; far:
    `far_counts` sites within `far_radii`, neighbors included, in order of index; a radius of -1: none are stored.
    """

    places: wp.array[wp.vec3]
    normals: wp.array[wp.vec3]
    islands: wp.array[int]
    around: wp.array2d[int]
    apart: wp.array2d[float]
    counts: wp.array[int]
    gaps: wp.array[float]
    spacings: wp.array[float]
    far: wp.array2d[int]
    far_counts: wp.array[int]
    far_radii: wp.array[float]


@wp.func
def detour_of(normal: wp.vec3, island: int, detour: float, site_normal: wp.vec3, site_island: int):
    """Return the offset of a site's squared distance: zero on the same side of the same island."""
    if site_island != island:
        return detour
    # Zero up to somewhat more than a right angle: faces at a sharp edge count as one side.
    return detour * wp.clamp(-1.5 * wp.dot(normal, site_normal) - 0.5, 0.0, 1.0)


@wp.func
def candidate(sites: Sites, site: int, slot: int):
    """Return the candidate site in a slot: 0, or one returned by `next_slot`."""
    if slot < wp.static(_FIRST_FAR):
        return sites.around[site, slot]
    if slot < wp.static(_FIRST_OF_ALL):
        return sites.far[site, slot - wp.static(_FIRST_FAR)]
    return slot - wp.static(_FIRST_OF_ALL)


@wp.func
def next_slot(sites: Sites, site: int, slot: int, reach: float):
    """Return the slot of the next candidate that may be within a distance of a site, -1 for none.

    Candidates are first the neighbors, in order of distance, then in order of index all sites, or only the far sites
    if these include all sites within the distance: the others would change nothing.
    """
    following = slot + 1
    if following > wp.static(_FIRST_OF_ALL):
        if following - wp.static(_FIRST_OF_ALL) == sites.places.shape[0]:
            following = -1
    elif following < sites.counts[site]:
        if sites.apart[site, following] > reach:
            following = -1
    elif following == sites.counts[site]:
        if following == sites.places.shape[0]:
            following = -1
        elif sites.far_radii[site] >= wp.static(FAR_MARGIN) * reach:
            following = wp.static(_FIRST_FAR)
        else:
            following = wp.static(_FIRST_OF_ALL)
    elif following - wp.static(_FIRST_FAR) == sites.far_counts[site]:
        following = -1
    return following


@wp.func
def nearest_site(point: wp.vec3, normal: wp.vec3, island: int, detour: float, sites: Sites, start: int):
    """Return the site nearest to a point, detours included; start: any site, a near one is faster."""
    nearest = start
    square = wp.length_sq(sites.places[nearest] - point)
    square += detour_of(normal, island, detour, sites.normals[nearest], sites.islands[nearest])
    searching = bool(True)
    while searching:
        site = nearest
        # Triangle inequality: sites beyond this distance are farther from the point than the nearest one [Elkan03].
        reach = wp.length(sites.places[site] - point) + wp.sqrt(square)
        slot = int(0)
        while slot >= 0:
            other = candidate(sites, site, slot)
            other_square = wp.length_sq(sites.places[other] - point)
            if other_square < square:
                other_square += detour_of(normal, island, detour, sites.normals[other], sites.islands[other])
                if other_square < square:
                    square = other_square
                    nearest = other
                    # The reach shrinks with the new nearest distance.
                    reach = wp.length(sites.places[site] - point) + wp.sqrt(square)
            slot = next_slot(sites, site, slot, reach)
        searching = nearest != site
    return nearest


@wp.func
def fixed(value: float):
    return wp.int64(wp.float64(value) * UNIT)


@dataclass(frozen=True)
class Sums:
    """Sums over each cell: masses (n,), first moments (n, 3) about its site, energies (n,); all float64.

    spacing: (n,) distance from each site to the next one on its side, infinite for a single site.
    """

    masses: np.ndarray
    moments: np.ndarray
    energies: np.ndarray
    spacing: np.ndarray

    @property
    def energy(self) -> float:
        """Total energy of all cells."""
        return float(self.energies.sum())


def sites_on(domain: Domain, points: SurfacePoints, device: wp.DeviceLike) -> Sites:
    """Return `Sites` at `SurfacePoints` of a `Domain`."""
    sites = Sites()
    sites.places = wp.array(positions(domain.mesh, points), dtype=wp.vec3, device=device)
    sites.normals = wp.array(domain.normals[points.triangle], dtype=wp.vec3, device=device)
    sites.islands = wp.array(domain.islands[points.triangle], dtype=int, device=device)
    shape = (len(points), min(MOST_AROUND, len(points)))
    sites.around = wp.empty(shape, dtype=int, device=device)
    sites.apart = wp.empty(shape, dtype=float, device=device)
    sites.counts = wp.empty(len(points), dtype=int, device=device)
    sites.gaps = wp.empty(len(points), dtype=float, device=device)
    sites.spacings = wp.empty(len(points), dtype=float, device=device)
    radius = _search_radius(domain, len(points))
    domain.grid.build(sites.places, CELLS_PER_RADIUS * radius)
    own = sites.places, sites.normals, sites.islands
    parallel.launch(
        _find_around,
        len(points),
        inputs=[*map(Rows, own), *own, domain.grid.id, radius, min(SITES_AROUND, len(points))],
        outputs=[sites.around, sites.apart, sites.counts, sites.gaps, sites.spacings],
        device=device,
        least_rows=512,
    )
    sites.far_radii = wp.full(len(points), -1.0, dtype=float, device=device)
    return sites


def _search_radius(domain, site_count):
    return SEARCH_RADIUS * float(np.sqrt(domain.parts.areas.sum() / site_count))


def find_far(domain: Domain, sites: Sites) -> None:
    """Find the far sites of the `Sites` in the grid of a `Domain`, where these shorten the search of all sites."""
    count, device = len(sites.places), sites.places.device
    if count <= 2 * MOST_FAR:
        return
    farthest = FARTHEST * _search_radius(domain, count)
    sites.far = wp.empty((count, MOST_FAR), dtype=int, device=device)
    sites.far_counts = wp.empty(count, dtype=int, device=device)
    parallel.launch(
        _find_far,
        count,
        inputs=[*map(Rows, (sites.places, sites.apart, sites.counts)), sites.places, domain.grid.id, farthest],
        outputs=[sites.far, sites.far_counts, sites.far_radii],
        device=device,
        least_rows=512,
    )


def some_sites(domain: Domain, sites: Sites, points: wp.array[wp.vec3]) -> wp.array[int]:
    """Return a nearby site (Q,) of each point as a Warp array, at which a search can start."""
    found = wp.empty(len(points), dtype=int, device=points.device)
    radius = float(np.sqrt(domain.parts.areas.sum() / len(sites.places)))
    inputs = [sites, Rows(points), domain.grid.id, radius]
    parallel.launch(_some_site, len(points), inputs, outputs=[found], device=points.device)
    return found


def detours(domain: Domain, densities: np.ndarray, site_count: int) -> np.ndarray:
    """Return the offsets (Q,) of squared distances for sites on the other side: (`DETOUR` × spacing)²."""
    areas = domain.amounts.sum() / (site_count * densities)
    return np.minimum(DETOUR**2 * areas, EVERYWHERE**2)


def sum_cells(
    kernel: wp.Kernel, count: int, inputs: list[Any], outputs: list[wp.array], sites: Sites, device: wp.DeviceLike
) -> Sums:
    """Return the `Sums` of a kernel that adds masses, moments and energies of cells, separately in each thread."""
    shapes = (len(sites.places), (len(sites.places), 3), len(sites.places))
    sums = [
        [wp.zeros(shape, dtype=wp.int64, device=device) for shape in shapes]
        for _ in range(parallel.share_count(count, device))
    ]
    parallel.launch_shares(kernel, count, inputs, [[*outputs, *own] for own in sums], device)
    masses, moments, energies = (
        np.sum([array.numpy() for array in arrays], axis=0) / float(UNIT) for arrays in zip(*sums, strict=True)
    )
    return Sums(masses, moments, energies, sites.gaps.numpy())


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
            # The order of a grid's points depends on the device.
            if apart < nearest or (apart == nearest and site < found):
                nearest = apart
                found = site
        radius = 2.0 * radius
    out_sites[point] = found


@wp.kernel
def _find_around(
    own_places: wp.array[wp.vec3],
    own_normals: wp.array[wp.vec3],
    own_islands: wp.array[int],
    places: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    islands: wp.array[int],
    grid: wp.uint64,
    first_radius: float,
    at_once: int,
    # outputs
    out_around: wp.array2d[int],
    out_apart: wp.array2d[float],
    out_counts: wp.array[int],
    out_gaps: wp.array[float],
    out_spacings: wp.array[float],
):
    site = wp.tid()
    place = own_places[site]
    last = wp.uint64(0)  # key of the farthest known neighbor
    radius = first_radius
    known = int(0)
    own_count = int(0)
    gap = float(wp.inf)
    total = float(0.0)
    ring = float(0.0)
    while known < out_around.shape[1] and (known == 0 or own_count < wp.static(ENOUGH_AROUND)):
        wanted = wp.min(at_once, out_around.shape[1] - known)
        nearest = near_keys()
        count = int(0)
        while count < wanted:
            nearest = near_keys(NO_KEY)
            count = int(0)
            for other in wp.hash_grid_query(grid, place, radius):
                square = wp.length_sq(places[other] - place)
                if square <= radius * radius:
                    key = key_of(square, other)
                    if known == 0 or key > last:
                        # Insert in order and drop the last key, without branches.
                        for slot in range(wp.static(SITES_AROUND)):
                            kept = nearest[slot]
                            nearest[slot] = wp.min(kept, key)
                            key = wp.max(kept, key)
                        count += 1
            if count < wanted:
                radius = 1.5 * radius
        for slot in range(wanted):
            other = point_of(nearest[slot])
            apart = wp.sqrt(square_of(nearest[slot]))
            out_around[site, known + slot] = other
            out_apart[site, known + slot] = apart
            if known + slot > 0:
                if detour_of(own_normals[site], own_islands[site], 1.0, normals[other], islands[other]) == 0.0:
                    gap = wp.min(gap, apart)
                    if own_count < wp.static(FIRST_RING):
                        total += apart
                        ring += 1.0
                    own_count += 1
        last = nearest[wanted - 1]
        known += wanted
    out_counts[site] = known
    if ring == 0.0 and known > 1:  # all near sites are on the other side
        gap = out_apart[site, known - 1]
        total = gap
    out_gaps[site] = gap
    out_spacings[site] = total / wp.max(ring, 1.0)


@wp.func
def _count_within(place: wp.vec3, radius: float, places: wp.array[wp.vec3], grid: wp.uint64):
    count = int(0)
    for other in wp.hash_grid_query(grid, place, radius):
        if wp.length_sq(places[other] - place) <= radius * radius:
            count += 1
            if count > wp.static(MOST_FAR):
                break
    return count


@wp.kernel
def _find_far(
    own_places: wp.array[wp.vec3],
    own_apart: wp.array2d[float],
    own_counts: wp.array[int],
    places: wp.array[wp.vec3],
    grid: wp.uint64,
    farthest: float,
    # outputs
    out_far: wp.array2d[int],
    out_counts: wp.array[int],
    out_radii: wp.array[float],
):
    site = wp.tid()
    place = own_places[site]
    neighbour_count = own_counts[site]
    least = own_apart[site, neighbour_count - 1]
    out_counts[site] = 0
    out_radii[site] = -1.0
    # If the first search found enough neighbors on the site's side, these nearly always suffice.
    if neighbour_count <= wp.static(SITES_AROUND):
        return
    radius = wp.min(wp.static(FAR) * least, farthest)
    while radius > least and _count_within(place, radius, places, grid) > wp.static(MOST_FAR):
        radius = 0.8 * radius
    if radius <= least:
        return
    count = int(0)
    for other in wp.hash_grid_query(grid, place, radius):
        if wp.length_sq(places[other] - place) <= radius * radius:
            out_far[site, count] = other
            count += 1
    # Shell's sort by index.
    gap = int(wp.static(MOST_FAR))
    while gap > 1:
        gap = (gap + 1) * 4 // 9
        for first in range(gap, count):
            index = out_far[site, first]
            slot = int(first)
            while slot >= gap and out_far[site, wp.max(slot - gap, 0)] > index:
                out_far[site, slot] = out_far[site, slot - gap]
                slot -= gap
            out_far[site, slot] = index
    out_counts[site] = count
    out_radii[site] = radius
