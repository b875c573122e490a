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
    detour_of,
    detours,
    find_far,
    fixed,
    nearest_site,
    next_slot,
    some_sites,
    sum_cells,
)

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

MOST_CORNERS = 16  # maximum corners of the part of a triangle in one cell
MOST_CELLS = 32  # maximum cells that share one triangle: pieces are no larger than cells

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
        # A triangle's second moment about its center is a twelfth of its area times its corners' squares.
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
        find_far(self._domain, sites)
        return sum_cells(_cells, len(self._pieces.centres), [self._pieces, sites], [self._cells], sites, self._device)


@wp.struct
class Polygon:
    """A part of a piece, in the plane of the piece and from its center."""

    xs: ring
    ys: ring
    across: labels  # the site beyond the edge that starts at each corner, -1: an edge of the piece
    count: int  # corners; 0: nothing is left
    farthest: float  # squared distance of a corner from the site, less that of the center


@wp.func
def _farther(farthest: float, x: float, y: float, sx: float, sy: float):
    """`Polygon.farthest` with one more corner; sx, sy: the site."""
    return wp.max(farthest, x * x + y * y - 2.0 * (x * sx + y * sy))


@wp.func
def _whole(pieces: Pieces, piece: int, sx: float, sy: float):
    """The `Polygon` of a whole piece."""
    whole = Polygon()
    whole.count = 3
    whole.farthest = 0.0
    for corner in range(3):
        p = pieces.corners[piece, corner]
        whole.xs[corner] = p[0]
        whole.ys[corner] = p[1]
        whole.across[corner] = -1
        whole.farthest = _farther(whole.farthest, p[0], p[1], sx, sy)
    return whole


@wp.func
def _clipped(given: Polygon, nx: float, ny: float, level: float, other: int, sx: float, sy: float):
    """The part of a convex `Polygon` where nx x + ny y is at most `level`, the border with another site."""
    kept = Polygon()
    clipped = int(0)
    farthest = float(-1.0e30)
    last = given.count - 1
    last_side = given.xs[last] * nx + given.ys[last] * ny - level
    for corner in range(given.count):
        side = given.xs[corner] * nx + given.ys[corner] * ny - level
        if (side > 0.0) != (last_side > 0.0) and clipped < MOST_CORNERS:
            t = last_side / (last_side - side)
            x = given.xs[last] + t * (given.xs[corner] - given.xs[last])
            y = given.ys[last] + t * (given.ys[corner] - given.ys[last])
            kept.xs[clipped] = x
            kept.ys[clipped] = y
            # Leaving the cell, the new edge is the border; entering, the rest of the old edge.
            if side > 0.0:
                kept.across[clipped] = other
            else:
                kept.across[clipped] = given.across[last]
            farthest = _farther(farthest, x, y, sx, sy)
            clipped += 1
        if side <= 0.0 and clipped < MOST_CORNERS:
            kept.xs[clipped] = given.xs[corner]
            kept.ys[clipped] = given.ys[corner]
            kept.across[clipped] = given.across[corner]
            farthest = _farther(farthest, given.xs[corner], given.ys[corner], sx, sy)
            clipped += 1
        last = corner
        last_side = side
    kept.count = clipped
    kept.farthest = farthest
    return kept


@wp.func
def _moments(cell: Polygon, sx: float, sy: float):
    """(area, integrals of x, of y times 3, and of x² + y² times 12) of a `Polygon` from the site."""
    area = float(0.0)
    mx = float(0.0)
    my = float(0.0)
    second = float(0.0)
    x0 = cell.xs[0] - sx
    y0 = cell.ys[0] - sy
    for corner in range(1, cell.count - 1):
        x1 = cell.xs[corner] - sx
        y1 = cell.ys[corner] - sy
        x2 = cell.xs[corner + 1] - sx
        y2 = cell.ys[corner + 1] - sy
        part = 0.5 * ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0))
        x = x0 + x1 + x2
        y = y0 + y1 + y2
        area += part
        mx += part * x
        my += part * y
        second += part * (x0 * x0 + y0 * y0 + x1 * x1 + y1 * y1 + x2 * x2 + y2 * y2 + x * x + y * y)
    return area, mx, my, second


@wp.func
def _reach(farthest: float, power: float, own_detour: float):
    """The distance from a site [m] beyond which no other site takes anything of a polygon."""
    radius_sq = wp.max(farthest + power - own_detour, 0.0)
    return wp.sqrt(radius_sq) + wp.sqrt(radius_sq + own_detour)


@wp.func
def _cell_of(
    site: int, piece: int, pieces: Pieces, sites: Sites, sx: float, sy: float, power: float, own_detour: float
):
    """The `Polygon` of a piece that is in a site's cell; power: squared distance from its center, with the detour."""
    centre = pieces.centres[piece]
    e1 = pieces.first_axes[piece]
    e2 = pieces.second_axes[piece]
    normal = wp.cross(e1, e2)
    cell = _whole(pieces, piece, sx, sy)
    reach = _reach(cell.farthest, power, own_detour)
    slot = int(0)
    while slot >= 0 and cell.count > 0:
        other = candidate(sites, site, slot)
        if other != site:
            offset = sites.places[other] - centre
            nx = 2.0 * (wp.dot(offset, e1) - sx)
            ny = 2.0 * (wp.dot(offset, e2) - sy)
            detour = detour_of(
                normal, pieces.islands[piece], pieces.detours[piece], sites.normals[other], sites.islands[other]
            )
            level = wp.length_sq(offset) + detour - power
            if nx == 0.0 and ny == 0.0 and level == 0.0 and other < site:
                cell.count = 0  # of coincident sites, the first one gets the cell
            worst = float(-1.0)
            for corner in range(cell.count):
                worst = wp.max(worst, cell.xs[corner] * nx + cell.ys[corner] * ny - level)
            if worst > 0.0:
                cell = _clipped(cell, nx, ny, level, other, sx, sy)
                reach = _reach(cell.farthest, power, own_detour)
        slot = next_slot(sites, site, slot, reach)
    return cell


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
    e1 = pieces.first_axes[piece]
    e2 = pieces.second_axes[piece]
    normal = wp.cross(e1, e2)
    weight = pieces.weights[piece]
    listed = cell_list()
    listed[0] = nearest
    listed_count = int(1)
    visited = int(0)
    while visited < listed_count:
        site = listed[visited]
        visited += 1
        offset = sites.places[site] - pieces.centres[piece]
        sx = wp.dot(offset, e1)
        sy = wp.dot(offset, e2)
        detour = detour_of(
            normal, pieces.islands[piece], pieces.detours[piece], sites.normals[site], sites.islands[site]
        )
        cell = _cell_of(site, piece, pieces, sites, sx, sy, wp.length_sq(offset) + detour, detour)
        if cell.count > 2:
            area, mx, my, second = _moments(cell, sx, sy)
            height = wp.dot(offset, normal)
            mass = weight * area
            # From the site to the part of its cell: within the plane, and perpendicular to it.
            moment = weight / 3.0 * (mx * e1 + my * e2) - mass * height * normal
            wp.atomic_add(out_masses, site, fixed(mass))
            for axis in range(3):
                wp.atomic_add(out_moments, site, axis, fixed(moment[axis]))
            wp.atomic_add(out_energies, site, fixed(weight * second / 12.0 + mass * (height * height + detour)))
        for corner in range(cell.count):
            other = cell.across[corner]
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
    while is_whole and slot >= 0:
        other = candidate(sites, nearest, slot)
        if other != nearest:
            apart = 2.0 * radius * wp.length(sites.places[other] - sites.places[nearest])
            is_whole = wp.length_sq(sites.places[other] - centre) - square > apart
        slot = next_slot(sites, nearest, slot, reach)
    if is_whole:
        moment = -pieces.areas[piece] * weight * offset
        wp.atomic_add(out_masses, nearest, fixed(weight * pieces.areas[piece]))
        for axis in range(3):
            wp.atomic_add(out_moments, nearest, axis, fixed(moment[axis]))
        wp.atomic_add(out_energies, nearest, fixed(weight * (pieces.inertias[piece] + pieces.areas[piece] * square)))
    else:
        _add_cut(piece, nearest, pieces, sites, out_masses, out_moments, out_energies)
