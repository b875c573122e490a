# SPDX-License-Identifier: GPL-3.0-or-later
"""Voronoi cells of sample points: fast, and accurate enough for few sites."""

import numpy as np
import warp as wp

from ..geometry.mesh import SurfacePoints, positions
from .domain import Domain
from .voronoi import Sites, Sums, detour_of, detours, find_far, fixed, nearest_site, some_sites, sum_cells

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

MOST_GROWTH = 1.25  # of the number of sites between two sums, for the search to start at the previous cells


@wp.struct
class Samples:
    """Sample points of the surface."""

    places: wp.array[wp.vec3]
    normals: wp.array[wp.vec3]
    weights: wp.array[float]
    islands: wp.array[int]
    detours: wp.array[float]


class SampledCells:
    """The cells of sites on a `Domain`, as sets of sample points (`SurfacePoints` of equal amounts)."""

    def __init__(
        self, domain: Domain, points: SurfacePoints, part: np.ndarray, site_count: int, device: wp.DeviceLike
    ) -> None:
        self._domain, self._device = domain, device
        self.places = positions(domain.mesh, points)
        self.densities = densities = domain.densities[part]
        self._samples = Samples()
        self._samples.places = wp.array(self.places, dtype=wp.vec3, device=device)
        self._samples.normals = wp.array(domain.normals[points.triangle], dtype=wp.vec3, device=device)
        self._samples.weights = wp.array(densities / densities.sum(), dtype=float, device=device)
        self._samples.islands = wp.array(domain.islands[points.triangle], dtype=int, device=device)
        self._samples.detours = wp.array(detours(domain, densities, site_count), dtype=float, device=device)
        self._cells, self._site_count = wp.empty(0, dtype=int, device=device), 0  # for no sites
        self._seconds = wp.zeros(len(points), dtype=int, device=device)

    def sums(self, sites: Sites, with_seconds: bool = False) -> Sums:
        """Return `Sums` for `Sites`."""
        # The search starts at the previous sites. With fewer sites their indices may be invalid, and with many new
        # sites a search by the grid is faster.
        if not self._site_count <= len(sites.places) <= MOST_GROWTH * self._site_count:
            self._cells = some_sites(self._domain, sites, self._samples.places)
        self._site_count = len(sites.places)
        find_far(self._domain, sites)
        inputs, outputs = [self._samples, sites, with_seconds], [self._cells, self._seconds]
        return sum_cells(_nearest_two, len(self.places), inputs, outputs, sites, self._device)

    def renumber(self, numbers: np.ndarray) -> None:
        """Renumber the sites of the previous sums, at which the next search starts; numbers: (n,)."""
        self._site_count = int(numbers.max()) + 1
        self._cells = wp.array(numbers[self._cells.numpy()], dtype=int, device=self._device)

    def nearest(self, sites: Sites) -> np.ndarray:
        """Return the nearest site (Q,) of each sample."""
        self.sums(sites)
        return self._cells.numpy().astype(np.int64)

    def nearest_two(self, sites: Sites) -> tuple[np.ndarray, np.ndarray]:
        """Return the nearest site (Q,) of each sample, and the second nearest (Q,), -1 for none."""
        self.sums(sites, with_seconds=True)
        return self._cells.numpy().astype(np.int64), self._seconds.numpy().astype(np.int64)


@wp.kernel
def _nearest_two(
    samples: Samples,
    sites: Sites,
    with_seconds: bool,
    first_sample: int,
    # outputs; cells contain any initial sites for the search; sums are accumulated
    out_cells: wp.array[int],
    out_seconds: wp.array[int],
    out_masses: wp.array[wp.int64],
    out_moments: wp.array2d[wp.int64],
    out_energies: wp.array[wp.int64],
):
    sample = first_sample + wp.tid()
    point = samples.places[sample]
    normal = samples.normals[sample]
    island = samples.islands[sample]
    detour = samples.detours[sample]
    weight = samples.weights[sample]
    site = nearest_site(point, normal, island, detour, sites, out_cells[sample])
    out_cells[sample] = site
    offset = point - sites.places[site]
    square = wp.length_sq(offset) + detour_of(normal, island, detour, sites.normals[site], sites.islands[site])
    wp.atomic_add(out_masses, site, fixed(weight))
    for axis in range(3):
        wp.atomic_add(out_moments, site, axis, fixed(weight * offset[axis]))
    wp.atomic_add(out_energies, site, fixed(weight * square))
    if not with_seconds:
        return
    second = int(-1)
    second_square = float(wp.inf)
    for slot in range(sites.counts[site]):
        # All further sites are farther from the sample than the present second one.
        if sites.apart[site, slot] > wp.length(offset) + wp.sqrt(second_square):
            break
        other = sites.around[site, slot]
        if other != site:
            other_square = wp.length_sq(sites.places[other] - point)
            if other_square < second_square:
                other_square += detour_of(normal, island, detour, sites.normals[other], sites.islands[other])
                if other_square < second_square:
                    second_square = other_square
                    second = other
    out_seconds[sample] = second
