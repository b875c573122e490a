# SPDX-License-Identifier: GPL-3.0-or-later
"""The domain of roots: the surface with its density, divided into pieces small enough for sums over cells."""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
import warp as wp

from ..errors import HairError
from ..geometry.closest_point import SurfaceQuery
from ..geometry.faces.connected_components import connected_components
from ..geometry.faces.uv_maps import Texture
from ..geometry.mesh import SurfacePoints, TriMesh, interpolate, positions
from ..geometry.mirror import Mirror
from ..geometry.sampling import check_density, corner_masses

GRID_SIZE = 32  # cells along each axis of the grid of sites; distant cells wrap around
LONGEST_EDGE = 2.5  # longest edge of a piece, in spacings of sites: few cells share a piece
LONGEST_GRADED_EDGE = 1.5  # the same for varying density, which is constant in a piece
SLIVER_LENGTH, SLIVER_WIDTH = (
    8.0,
    0.5,
)  # of the longest and the shortest edge, relative to a piece's longest allowed edge
MOST_SLICES = 64  # maximum slices of a sliver in one step: the density may vary along it
LEAST_COSINE = -1.0 / 3.0  # least cosine between normals of one side of a surface
LEAST_PIECES = 2000  # least site count assumed for the cutting: the density is constant in a piece
PLASTIC = 0.7548776662466927, 0.5698402909980532  # steps of the R2 low-discrepancy sequence [Roberts18]


@dataclass(frozen=True)
class Parts:
    """Q triangles that are parts of a mesh's triangles.

    triangle: (Q,), the mesh's triangles; barycentric: (Q, 3, 3) of the parts' corners; corners: (Q, 3, 3), positions at
    unit size; areas: (Q,).
    """

    triangle: np.ndarray
    barycentric: np.ndarray
    corners: np.ndarray
    areas: np.ndarray

    def chosen(self, selection: np.ndarray) -> "Parts":
        """Return the parts of a mask or an index array."""
        if selection.dtype == bool and selection.all():
            return self
        return Parts(*(getattr(self, field.name)[selection] for field in fields(self)))

    def joined(self, *others: "Parts") -> "Parts":
        """Return these parts followed by others."""
        if not others:
            return self
        every = (self, *others)
        return Parts(*(np.concatenate([getattr(part, field.name) for part in every]) for field in fields(self)))

    def centres(self) -> SurfacePoints:
        """Return the centroids as `SurfacePoints`."""
        centres = self.barycentric[:, 0] + self.barycentric[:, 1] + self.barycentric[:, 2]
        return SurfacePoints(self.triangle.astype(np.int32), (centres / 3.0).astype(np.float32))


class Domain:
    """A checked `TriMesh` at unit size with a density D, normalized by `densest`, cut for a number of sites.

    mesh: scaled by 1 / `size` [m]; normals: (F, 3), unit; islands: (F,); parts: `Parts` of positive density, on one
    side of the mirror if there is one; densities (Q,): mean of D; amounts (Q,): ∫ D dA; mass: ∫ D² dA; query: closest
    points on the mesh; grid: of sites. Raises `HairError` if the density is zero everywhere.
    """

    def __init__(
        self,
        mesh: TriMesh,
        site_count: int,
        density: np.ndarray | None = None,
        texture: Texture | None = None,
        mirror: Mirror | None = None,
        device: wp.DeviceLike = "cpu",
    ) -> None:
        has_area = mesh.areas > 0.0
        is_used = np.zeros(len(mesh.vertices), bool)
        is_used[mesh.triangles[has_area]] = True
        used = mesh.vertices[is_used]
        lowest, highest = used.min(axis=0), used.max(axis=0)
        self.size = float((highest - lowest).max())
        self.origin = lowest.astype(np.float64)
        # Unused vertices may be far away, which would reduce the precision of the others.
        inside = np.clip(mesh.vertices, lowest, highest)
        self.mesh = TriMesh(((inside - lowest) / np.float32(self.size)).astype(np.float32), mesh.triangles)
        values = check_density(self.mesh, density)
        self.densest = float(values.max())
        self._values, self._texture = values / self.densest, texture
        lengths = np.linalg.norm(self.mesh.scaled_normals, axis=1, keepdims=True)
        self.normals = self.mesh.scaled_normals / np.where(lengths > 0.0, lengths, 1.0)
        self.islands = connected_components(self.mesh)
        self._mirror = mirror
        grown = np.flatnonzero(has_area & corner_masses(self.mesh, self._values).any(axis=1))
        self.query = SurfaceQuery(self.mesh, grown, device)
        self.grid = wp.HashGrid(GRID_SIZE, GRID_SIZE, GRID_SIZE, device=device)
        corners = np.broadcast_to(np.eye(3), (len(grown), 3, 3))
        whole = Parts(grown, corners, self.mesh.corners[grown], self.mesh.areas[grown])
        if mirror is not None:
            whole = self._heavier_side(whole)
        if texture is not None:  # a texture may be finer than triangles
            spacing = _spacing(whole.areas.sum(), LEAST_PIECES)
            whole = cut(whole, LONGEST_GRADED_EDGE * spacing, lambda parts: 1.0)
        # Pieces are smaller where the density is higher.
        amount = (whole.areas * self.density_at(whole.centres())).sum()
        if not amount > 0.0:
            raise HairError("The density is zero everywhere: paint weight where hair should grow.")
        spacing = _spacing(amount, max(site_count, LEAST_PIECES))
        if texture is None and np.ptp(self._values) == 0.0:
            self.parts = cut(whole, LONGEST_EDGE * spacing, lambda parts: 1.0)
        else:
            self.parts = cut(whole, LONGEST_GRADED_EDGE * spacing, self._least_density)
        self.densities = self.density_at(self.parts.centres())
        self.parts, self.densities = self.parts.chosen(self.densities > 0.0), self.densities[self.densities > 0.0]
        self.amounts = self.parts.areas * self.densities
        self.mass = float((self.amounts * self.densities).sum())

    def density_at(self, points: SurfacePoints) -> np.ndarray:
        """Return D (N,) float64 at `SurfacePoints`; the given density has maximum 1."""
        density = interpolate(self._values, self.mesh, points).astype(np.float64)
        return density if self._texture is None else density * self._texture.at(points)

    def _least_density(self, parts):
        """Return D (Q,), at least 1e-3, which bounds the size of pieces."""
        return np.maximum(self.density_at(parts.centres()), 1e-3)

    def moved(self, points: SurfacePoints, places: np.ndarray) -> SurfacePoints:
        """Return `SurfacePoints` moved to the points of the domain closest to places (N, 3).

        Points that would change sides or islands, have zero density, or cross the mirror, do not move.
        """
        if self._mirror is not None:
            places = places - np.minimum(self._heights(places), 0.0)[:, None] * self._mirror.normal
        # The present point is an upper bound, with a margin for rounding.
        farthest = 1.01 * np.linalg.norm(places - positions(self.mesh, points), axis=1) + 1e-5
        found = self.query.nearest(places, farthest)
        before, after = self.normals[points.triangle], self.normals[found.triangle]
        is_good = (np.einsum("ni,ni->n", before, after) > LEAST_COSINE) & (self.density_at(found) > 0.0)
        is_good &= self.islands[found.triangle] == self.islands[points.triangle]
        if self._mirror is not None:
            is_good &= self._heights(positions(self.mesh, found)) >= -1e-5
        return SurfacePoints(
            np.where(is_good, found.triangle, points.triangle),
            np.where(is_good[:, None], found.barycentric, points.barycentric),
        )

    def samples(self, count: int, random: np.random.Generator | None = None) -> tuple[SurfacePoints, np.ndarray]:
        """Return `count` sample points of equal amount, as `SurfacePoints`, and their parts (count,).

        Samples are stratified over the cumulative amount, sorted by island, so each island has its share; random: a
        generator for the positions in the strata, None for a low-discrepancy sequence.
        """
        order = np.argsort(self.islands[self.parts.triangle], kind="stable")
        running = np.cumsum(self.amounts[order])
        number = np.arange(count)
        if random is None:
            within, first, second = 0.5, *((0.5 + number * step) % 1.0 for step in PLASTIC)
        else:
            within, first, second = random.random((3, count))
        part = order[np.searchsorted(running, (number + within) / count * running[-1]).clip(0, len(order) - 1)]
        folded = first + second > 1.0
        first, second = np.where(folded, 1.0 - first, first), np.where(folded, 1.0 - second, second)
        weights = np.stack([first, second, 1.0 - first - second], axis=1)
        barycentric = np.einsum("nc,nck->nk", weights, self.parts.barycentric[part])
        return SurfacePoints(self.parts.triangle[part].astype(np.int32), barycentric.astype(np.float32)), part

    def symmetric(self, half: SurfacePoints, count: int) -> SurfacePoints:
        """Return `count` `SurfacePoints`: one half, (count + 1) // 2 points, and their closest images on the surface.

        For an odd count the point nearest to the mirror moves to the mirror, and is its own image.
        """
        places = positions(self.mesh, half).astype(np.float64)
        heights = self._heights(places)
        if count % 2:
            order = np.append(np.delete(np.arange(len(half)), np.argmin(heights)), np.argmin(heights))
            half, places, heights = half[order], places[order], heights[order]
            between = self.moved(half[-1:], places[-1:] - heights[-1] * self._normal)
            half = half[:-1].joined(between)
        images = (places - 2.0 * heights[:, None] * self._normal)[: count // 2]
        found = self.query.nearest(images) if len(images) else half[:0]
        # If the other side has no density, the image coincides with its original.
        is_bare = self.density_at(found) <= 0.0
        triangle = np.where(is_bare, half.triangle[: count // 2], found.triangle)
        barycentric = np.where(is_bare[:, None], half.barycentric[: count // 2], found.barycentric)
        return half.joined(SurfacePoints(triangle, barycentric))

    @property
    def _normal(self):
        """The mirror's normal (3,), towards the side of the sites."""
        if self._mirror is None:
            raise ValueError("This domain has no mirror.")
        return self._mirror.normal

    def _heights(self, places):
        """Return the heights (N,) of places above the mirror, at unit size."""
        return (places + self.origin / self.size) @ self._normal

    def _heavier_side(self, parts):
        """Return the parts above the mirror, cut along it; flips the mirror if its lower side has a larger amount."""
        above, below = (self._cut_at_mirror(parts, sign) for sign in (1.0, -1.0))
        above_amount, below_amount = ((side.areas * self.density_at(side.centres())).sum() for side in (above, below))
        if self._mirror is not None and below_amount > above_amount * (1.0 + 1e-6):
            self._mirror = self._mirror.flipped()
            return below
        return above

    def _cut_at_mirror(self, parts, sign):
        heights = sign * self._heights(parts.corners.reshape(-1, 3)).reshape(-1, 3)
        heights[np.abs(heights) < 1e-6] = 0.0
        lowest = heights.min(axis=1)
        pieces = [parts.chosen((lowest >= 0.0) & (heights.max(axis=1) > 0.0))]
        # The corner that is alone on its side comes first; the plane crosses its two edges.
        above_count = np.count_nonzero(heights > 0.0, axis=1)
        for alone, count in ((1.0, 1), (-1.0, 2)):
            crossed = np.flatnonzero((above_count == count) & (lowest < 0.0))
            first = np.argmax(alone * heights[crossed], axis=1)
            turn = (first[:, None] + np.arange(3)) % 3
            h = np.take_along_axis(heights[crossed], turn, axis=1)
            b = np.take_along_axis(parts.barycentric[crossed], turn[:, :, None], axis=1)
            shares = [h[:, 0] / (h[:, 0] - h[:, k]) for k in (1, 2)]
            cuts = [b[:, 0] + shares[k - 1][:, None] * (b[:, k] - b[:, 0]) for k in (1, 2)]
            area = parts.areas[crossed]
            tip = area * shares[0] * shares[1]
            if alone > 0.0:
                corners = [(np.stack([b[:, 0], *cuts], axis=1), tip)]
            else:
                near = area * (1.0 - shares[0])
                corners = [
                    (np.stack([cuts[0], b[:, 1], b[:, 2]], axis=1), near),
                    (np.stack([cuts[0], b[:, 2], cuts[1]], axis=1), area - tip - near),
                ]
            triangle = parts.triangle[crossed]
            pieces += [
                Parts(triangle, barycentric, barycentric @ self.mesh.corners[triangle], areas)
                for barycentric, areas in corners
            ]
        return pieces[0].joined(*pieces[1:])


def _spacing(amount, count):
    """Return the spacing of sites on an area, at unit size, with a lower limit for slivers.

    Without the limit, slivers alone would be cut into millions of pieces of their width.
    """
    return max(np.sqrt(amount / count), 8.0 / count)


def cut(parts: Parts, longest: float, density_of: Callable[[Parts], np.ndarray | float]) -> Parts:
    """Return parts cut until no edge is longer than `longest` / sqrt(density).

    Parts are halved across their longest edge; slivers are sliced across both long edges.
    """
    done = []
    while len(parts.areas):
        edges = parts.corners - parts.corners[:, (1, 2, 0)]
        squares = np.einsum("qcx,qcx->qc", edges, edges)
        limits = np.broadcast_to(longest**2 / density_of(parts), len(squares))
        is_long = squares.max(axis=1) > limits
        done.append(parts.chosen(~is_long))
        parts, squares, limits = parts.chosen(is_long), squares[is_long], limits[is_long]
        # Halving the length of a sliver would give three parts, two of which are slivers again.
        lengths = np.sqrt(squares / limits[:, None])
        is_sliver = (lengths.max(axis=1) > SLIVER_LENGTH) & (lengths.min(axis=1) <= SLIVER_WIDTH)
        halved = _halved(parts.chosen(~is_sliver), squares[~is_sliver].argmax(axis=1))
        parts = halved.joined(_sliced(parts.chosen(is_sliver), lengths[is_sliver])) if is_sliver.any() else halved
    return done[0].joined(*done[1:])


def _sliced(parts, lengths):
    """Return slivers cut into slices of two triangles, one at the tip; lengths (Q, 3): of edges, in limits."""
    rows, base = np.arange(len(lengths)), lengths.argmin(axis=1)
    length, width = lengths.max(axis=1), lengths[rows, base]
    counts = np.minimum(np.ceil(length / (1.0 - width)), MOST_SLICES).astype(int)  # no diagonal becomes too long
    of_part = np.repeat(rows, counts)
    slices = np.arange(len(of_part)) - np.repeat(np.cumsum(counts) - counts, counts)
    near, far = slices / counts[of_part], (slices + 1) / counts[of_part]
    pieces = [[], []]
    for corners in (parts.barycentric, parts.corners):
        one, other, tip = (corners[rows, (base + turn) % 3][of_part] for turn in range(3))
        sides = [(end - tip).astype(np.float64) for end in (one, other)]
        ends = [[(tip + at[:, None] * side).astype(corners.dtype) for side in sides] for at in (near, far)]
        (near_one, near_other), (far_one, far_other) = ends
        pieces[0].append(np.stack([near_one, far_one, far_other], axis=1))
        pieces[1].append(np.stack([near_one, far_other, near_other], axis=1)[slices > 0])
    whole = parts.areas[of_part] / counts[of_part] ** 2
    areas = whole * (slices + 1), (whole * slices)[slices > 0]
    triangles = parts.triangle[of_part], parts.triangle[of_part][slices > 0]
    one, other = (Parts(*rest) for rest in zip(triangles, *zip(*pieces, strict=True), areas, strict=True))
    return one.joined(other)


def _halved(parts, edge):
    """Return parts, each cut into two at the midpoint of the edge that begins at corner `edge` (Q,)."""
    rows = np.arange(len(edge))
    first, second = [], []
    for corners in (parts.barycentric, parts.corners):
        one, other, across = (corners[rows, (edge + turn) % 3] for turn in range(3))
        middle = 0.5 * (one + other)
        first.append(np.stack([one, middle, across], axis=1))
        second.append(np.stack([middle, other, across], axis=1))
    one, other = (Parts(parts.triangle, half[0], half[1], 0.5 * parts.areas) for half in (first, second))
    return one.joined(other)
