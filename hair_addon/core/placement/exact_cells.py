# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact restricted Voronoi cells.

Each triangle is clipped by the bisecting planes of the sites that can reach it. The cells that share a triangle are
found by propagation across borders that cross it [Yan09].
"""

import numpy as np
import warp as wp

from .domain import Domain
from .voronoi import (
    Sites,
    Sums,
    candidate,
    candidate_count,
    detour_of,
    detours,
    fixed,
    nearest_site,
    some_sites,
    sum_cells,
)

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

MOST_CORNERS = 16  # of the part of a triangle in one cell
MOST_CELLS = 32  # that share one triangle: pieces are no larger than cells

ring = wp.types.vector(length=MOST_CORNERS, dtype=float)
labels = wp.types.vector(length=MOST_CORNERS, dtype=int)
cell_list = wp.types.vector(length=MOST_CELLS, dtype=int)


@wp.struct
class Pieces:
    """Triangles: corners in plane coordinates about `centres`; detours: squared distance offset of the other side."""

    centres: wp.array[wp.vec3]
    first_axes: wp.array[wp.vec3]
    second_axes: wp.array[wp.vec3]
    corners: wp.array2d[wp.vec2]
    weights: wp.array[float]
    islands: wp.array[int]
    detours: wp.array[float]
    radii: wp.array[float]
    areas: wp.array[float]
    inertias: wp.array[float]


class CutCells:
    """The cells of sites on a `Domain`, cut exactly out of its parts.

    site_count: for `detours`; weights (Q,): densities of the masses, None for ρ.
    """

    def __init__(
        self, domain: Domain, site_count: int, device: wp.DeviceLike, weights: np.ndarray | None = None
    ) -> None:
        self._domain, parts, self._device = domain, domain.parts, device
        corners = parts.corners
        centres = corners.mean(axis=1)
        first_axes = corners[:, 1] - corners[:, 0]
        first_axes /= np.linalg.norm(first_axes, axis=1, keepdims=True)
        second_axes = np.cross(domain.normals[parts.triangle], first_axes)
        arms = corners - centres[:, None]
        flat = np.stack([np.einsum("qcx,qx->qc", arms, axes) for axes in (first_axes, second_axes)], axis=2)
        self._pieces = Pieces()
        for name, vectors in (("centres", centres), ("first_axes", first_axes), ("second_axes", second_axes)):
            setattr(self._pieces, name, wp.array(vectors, dtype=wp.vec3, device=device))
        squares = np.einsum("qcx,qcx->qc", flat, flat)
        # A triangle's second moment about its centre is a twelfth of its area times its corners' squares.
        inertias = parts.areas * squares.sum(axis=1) / 12.0
        numbers = {"radii": np.sqrt(squares.max(axis=1)), "areas": parts.areas, "inertias": inertias}
        for name, values in numbers.items():
            setattr(self._pieces, name, wp.array(values, dtype=float, device=device))
        self._pieces.corners = wp.array(flat, dtype=wp.vec2, device=device)
        self._pieces.weights = wp.array(
            domain.densities**2 / domain.mass if weights is None else weights, dtype=float, device=device
        )
        self._pieces.islands = wp.array(domain.islands[parts.triangle], dtype=int, device=device)
        self._pieces.detours = wp.array(detours(domain, domain.densities, site_count), dtype=float, device=device)
        self._cells, self._site_count = None, 0

    def sums(self, sites: Sites) -> Sums:
        """Return `Sums` for `Sites`."""
        # The search starts at the previous sites, whose indices are invalid if the number of sites has changed.
        if self._cells is None or self._site_count != len(sites.places):
            self._site_count = len(sites.places)
            self._cells = some_sites(self._domain, sites, self._pieces.centres)
        return sum_cells(_cells, len(self._pieces.centres), [self._pieces, sites], [self._cells], sites, self._device)


@wp.func
def _add_cut(
    piece: int,
    nearest: int,
    pieces: Pieces,
    sites: Sites,
    # outputs
    out_masses: wp.array[wp.int64],
    out_moments: wp.array2d[wp.int64],
    out_energies: wp.array[wp.int64],
):
    """Add a piece to the cells that share it; `nearest` is one of them.

    A separate function, so that its local arrays are initialized only for pieces that are cut.
    """
    centre = pieces.centres[piece]
    e1 = pieces.first_axes[piece]
    e2 = pieces.second_axes[piece]
    normal = wp.cross(e1, e2)
    island = pieces.islands[piece]
    detour = pieces.detours[piece]
    weight = pieces.weights[piece]
    listed = cell_list()
    listed[0] = nearest
    listed_count = int(1)
    visited = int(0)
    while visited < listed_count:
        site = listed[visited]
        visited += 1
        offset = sites.places[site] - centre
        sx = wp.dot(offset, e1)
        sy = wp.dot(offset, e2)
        own_detour = detour_of(normal, island, detour, sites.normals[site], sites.islands[site])
        power = wp.length_sq(offset) + own_detour

        xs = ring()
        ys = ring()
        across = labels()  # the site beyond the edge that starts at each corner
        count = int(3)
        farthest = float(0.0)
        for corner in range(3):
            p = pieces.corners[piece, corner]
            xs[corner] = p[0]
            ys[corner] = p[1]
            across[corner] = -1
            farthest = wp.max(farthest, wp.dot(p, p) - 2.0 * (p[0] * sx + p[1] * sy))
        radius_sq = wp.max(farthest + power - own_detour, 0.0)
        reach = wp.sqrt(radius_sq) + wp.sqrt(radius_sq + own_detour)

        slot = int(0)
        while slot < candidate_count(sites, site) and count > 0:
            if slot < sites.counts[site]:
                if sites.apart[site, slot] > reach:
                    break
            other = candidate(sites, site, slot)
            slot += 1
            if other != site:
                other_offset = sites.places[other] - centre
                nx = 2.0 * (wp.dot(other_offset, e1) - sx)
                ny = 2.0 * (wp.dot(other_offset, e2) - sy)
                level = (
                    wp.length_sq(other_offset)
                    + detour_of(normal, island, detour, sites.normals[other], sites.islands[other])
                    - power
                )
                if nx == 0.0 and ny == 0.0 and level == 0.0 and other < site:
                    count = 0  # of coincident sites, the first one gets the cell
                worst = float(-1.0)
                for corner in range(count):
                    worst = wp.max(worst, xs[corner] * nx + ys[corner] * ny - level)
                if worst > 0.0:
                    clipped_xs = ring()
                    clipped_ys = ring()
                    clipped_across = labels()
                    clipped = int(0)
                    last = count - 1
                    last_side = xs[last] * nx + ys[last] * ny - level
                    farthest = float(-1.0e30)
                    for corner in range(count):
                        side = xs[corner] * nx + ys[corner] * ny - level
                        if (side > 0.0) != (last_side > 0.0) and clipped < MOST_CORNERS:
                            t = last_side / (last_side - side)
                            x = xs[last] + t * (xs[corner] - xs[last])
                            y = ys[last] + t * (ys[corner] - ys[last])
                            clipped_xs[clipped] = x
                            clipped_ys[clipped] = y
                            # Leaving the cell, the new edge is the border; entering, the rest of the old edge.
                            if side > 0.0:
                                clipped_across[clipped] = other
                            else:
                                clipped_across[clipped] = across[last]
                            farthest = wp.max(farthest, x * x + y * y - 2.0 * (x * sx + y * sy))
                            clipped += 1
                        if side <= 0.0 and clipped < MOST_CORNERS:
                            clipped_xs[clipped] = xs[corner]
                            clipped_ys[clipped] = ys[corner]
                            clipped_across[clipped] = across[corner]
                            x = xs[corner]
                            y = ys[corner]
                            farthest = wp.max(farthest, x * x + y * y - 2.0 * (x * sx + y * sy))
                            clipped += 1
                        last = corner
                        last_side = side
                    xs = clipped_xs
                    ys = clipped_ys
                    across = clipped_across
                    count = clipped
                    radius_sq = wp.max(farthest + power - own_detour, 0.0)
                    reach = wp.sqrt(radius_sq) + wp.sqrt(radius_sq + own_detour)

        if count > 2:
            area = float(0.0)
            mx = float(0.0)
            my = float(0.0)
            second = float(0.0)
            x0 = xs[0] - sx
            y0 = ys[0] - sy
            for corner in range(1, count - 1):
                x1 = xs[corner] - sx
                y1 = ys[corner] - sy
                x2 = xs[corner + 1] - sx
                y2 = ys[corner + 1] - sy
                part = 0.5 * ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0))
                x = x0 + x1 + x2
                y = y0 + y1 + y2
                area += part
                mx += part * x
                my += part * y
                second += part * (x0 * x0 + y0 * y0 + x1 * x1 + y1 * y1 + x2 * x2 + y2 * y2 + x * x + y * y)
            height = wp.dot(offset, normal)
            mass = weight * area
            # From the site to the part of its cell: within the plane, and perpendicular to it.
            moment = weight / 3.0 * (mx * e1 + my * e2) - mass * height * normal
            wp.atomic_add(out_masses, site, fixed(mass))
            for axis in range(3):
                wp.atomic_add(out_moments, site, axis, fixed(moment[axis]))
            wp.atomic_add(out_energies, site, fixed(weight * second / 12.0 + mass * (height * height + own_detour)))
        for corner in range(count):
            other = across[corner]
            if other >= 0 and listed_count < MOST_CELLS:
                known = bool(False)
                for place in range(listed_count):
                    known = known or listed[place] == other
                if not known:
                    listed[listed_count] = other
                    listed_count += 1


@wp.kernel
def _cells(
    pieces: Pieces,
    sites: Sites,
    first_piece: int,
    # outputs; cells contain any initial sites for the search; sums are accumulated
    out_cells: wp.array[int],
    out_masses: wp.array[wp.int64],
    out_moments: wp.array2d[wp.int64],
    out_energies: wp.array[wp.int64],
):
    piece = first_piece + wp.tid()
    centre = pieces.centres[piece]
    normal = wp.cross(pieces.first_axes[piece], pieces.second_axes[piece])
    island = pieces.islands[piece]
    detour = pieces.detours[piece]
    weight = pieces.weights[piece]
    nearest = nearest_site(centre, normal, island, detour, sites, out_cells[piece])
    out_cells[piece] = nearest

    # If no border crosses the piece's bounding circle, the whole piece belongs to its nearest site.
    offset = sites.places[nearest] - centre
    radius = pieces.radii[piece]
    square = wp.length_sq(offset)
    is_whole = detour_of(normal, island, detour, sites.normals[nearest], sites.islands[nearest]) == 0.0
    reach = 2.0 * (wp.sqrt(square) + radius)
    slot = int(0)
    while is_whole and slot < candidate_count(sites, nearest):
        if slot < sites.counts[nearest]:
            if sites.apart[nearest, slot] > reach:
                break
        other = candidate(sites, nearest, slot)
        slot += 1
        if other != nearest:
            apart = 2.0 * radius * wp.length(sites.places[other] - sites.places[nearest])
            is_whole = wp.length_sq(sites.places[other] - centre) - square > apart
    if is_whole:
        moment = -pieces.areas[piece] * weight * offset
        wp.atomic_add(out_masses, nearest, fixed(weight * pieces.areas[piece]))
        for axis in range(3):
            wp.atomic_add(out_moments, nearest, axis, fixed(moment[axis]))
        wp.atomic_add(out_energies, nearest, fixed(weight * (pieces.inertias[piece] + pieces.areas[piece] * square)))
    else:
        _add_cut(piece, nearest, pieces, sites, out_masses, out_moments, out_energies)
