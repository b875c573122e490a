# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of the pieces of a hair mesh: cards, tubes and solid locks.

Strands of a card run from its root end to its tip end, spread over its width with random offsets unless they fill it,
along the opaque parts of its texture. Strands of a tube or a lock are evenly distributed over its cross sections, on
the spiral of [Vogel79]. Strands that fill a tube or a lock with their radii are denser along its rim.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import HairError
from ..geometry.closest_point import SurfaceQuery
from ..geometry.mesh import SurfacePoints, TriMesh, positions
from ..long_work import Progress, no_progress, part_of
from . import card_lines, lock_sections, ribbon_charts, texture_alpha
from .card_lines import Card
from .mesh_pieces import Piece, pieces_of
from .mesh_strand_settings import MOST_STRANDS, MeshStrandSettings
from .mesh_strands import MeshStrands

_CLEAR = 0.1  # difference of two ends' distances to the surface, relative to the length, that determines the root
_JITTER = 0.6  # of a strand's place, relative to the distance of strands across a card
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # [rad]
_RIM, _INSET = 2.0, 0.8  # number at the rim relative to the square root of all; inset relative to the radius
_MOST_FACES = 20_000  # of a piece: larger pieces beside smaller pieces are bodies
_MOST_SCULPTED = 500_000  # of a piece, if all pieces are larger than `_MOST_FACES`; takes ten seconds


def mesh_strands(
    mesh: TriMesh,
    surface: TriMesh,
    settings: MeshStrandSettings,
    corner_uvs: np.ndarray | None = None,
    progress: Progress = no_progress,
    alpha_at: Callable[[SurfacePoints], np.ndarray] | None = None,
) -> MeshStrands:
    """Return the strands of a hair mesh, both in the same coordinates [m].

    corner_uvs: (F, 3, 2) of triangles' corners, None without a UV map; alpha_at: a function that returns the alpha (N,)
    in [0, 1] of the texture at places on the hair mesh, which strands of cards follow, None without. Raises
    `HairError`.
    """
    if settings.root_end != "SURFACE" and corner_uvs is None:
        raise HairError("The hair mesh has no UV map: choose its roots by the surface.")
    progress("Finding cards", 0.0)
    pieces = pieces_of(mesh)
    counts = _shares(mesh, pieces, settings.strand_count)
    has_small = any(len(piece.faces) <= _MOST_FACES for piece in pieces)
    most_faces = _MOST_FACES if has_small else _MOST_SCULPTED
    maker = _Maker(mesh, surface, settings, corner_uvs, most_faces)
    for place, (piece, count) in enumerate(zip(pieces, counts.tolist(), strict=True)):
        if place % 256 == 0:
            part_of(progress, 0.1, 0.8 if alpha_at is None else 0.4)("Following cards", place / len(pieces))
        maker.add(piece, count)
    maker.require_count()
    if alpha_at is not None:
        texture_alpha.follow(maker.cards, mesh, settings.fills, alpha_at, part_of(progress, 0.4, 0.8))
    progress("Placing strands", 0.8)
    return maker.strands()


def _shares(mesh, pieces, count):
    """Return the number of strands (P,) of each piece: one, and a share of the others by area."""
    areas = np.add.reduceat(
        mesh.areas[np.concatenate([piece.faces for piece in pieces])],
        np.cumsum([0] + [len(piece.faces) for piece in pieces[:-1]]),
    )
    more = max(count - len(pieces), 0)
    ends = np.round(np.cumsum(areas) / max(areas.sum(), 1e-300) * more).astype(np.int64)
    return 1 + np.diff(ends, prepend=0)


@dataclass(frozen=True)
class _Lock:
    """Strands of a tube or a lock: points (count * K, 3), corners of the mesh there, and radii (K,) [m]."""

    count: int
    radii: np.ndarray
    points: np.ndarray
    corners: np.ndarray

    @property
    def stations(self):
        return len(self.radii)


class _Maker:
    """Strands of the pieces of a mesh, which are added in turn."""

    def __init__(self, mesh, surface, settings, corner_uvs, most_faces):
        self._mesh, self._settings, self._uvs, self._most_faces = mesh, settings, corner_uvs, most_faces
        self._away = _distances(surface, mesh.vertices)
        self._vertices = mesh.vertices.astype(np.float64)
        self._random = np.random.default_rng(settings.seed)
        self._charts = ribbon_charts.Charts()
        self.cards: list[Card] = []
        self._parts: list[Card | _Lock] = []
        self._skipped = 0

    def add(self, piece: Piece, count: int) -> None:
        """Add the strands of a piece, or count it as skipped."""
        topology, points = piece.topology, self._vertices[piece.vertices]
        if len(piece.faces) > self._most_faces or not topology.is_simple or not np.ptp(points, axis=0).max() > 0.0:
            self._skipped += 1
        elif topology.euler_characteristic == 1 and not _is_closed_at_tip(topology, points):
            self._add_card(piece, points, count)
        else:
            self._add_lock(piece, points, count)

    def require_count(self) -> None:
        """Raise `HairError` without strands, and for too many of them."""
        if not self._parts:
            raise HairError(
                "The hair mesh has no cards, tubes or slender locks of at most {most} triangles: pick a mesh of them.",
                most=self._most_faces,
            )
        total = sum(part.count for part in self._parts)
        if total > MOST_STRANDS:
            raise HairError("{count} strands exceed {most}: use fewer strands.", count=total, most=MOST_STRANDS)

    def strands(self) -> MeshStrands:
        """Return the strands of all pieces. Raises `HairError` if the texture hides all of them."""
        points, faces, barycentric = self._on_charts()
        found: list[tuple] = []
        used = 0
        for part in self._parts:
            if isinstance(part, Card):
                rows = slice(used, used + len(part.lines.radii))
                found.append((points[rows], faces[rows], barycentric[rows], part.lines.radii, part.lines.counts))
                used = rows.stop
            else:
                weights = np.eye(3, dtype=np.float32)[part.corners % 3]
                counts = np.full(part.count, part.stations)
                found.append((part.points, part.corners // 3, weights, np.tile(part.radii, part.count), counts))
        merged = [np.concatenate(rows) for rows in zip(*found, strict=True)]
        if not len(merged[4]):
            raise HairError(texture_alpha.HIDDEN)
        strand_counts = [len(rows[4]) for rows in found]
        return MeshStrands(
            merged[0].astype(np.float32),
            merged[4],
            merged[3].astype(np.float32),
            SurfacePoints(merged[1].astype(np.int32), merged[2].astype(np.float32)),
            np.repeat(np.arange(len(found)), strand_counts).astype(np.int32),
            len(self._parts),
            self._skipped,
        )

    def _add_card(self, piece, points, count):
        uvs = self._piece_uvs(piece)
        away = self._away[piece.vertices]
        chart, widths = self._charts.chart(piece.topology, points, uvs, away, self._root_first(away, uvs))
        across = (np.arange(count) + 0.5) / count
        if count > 1 and not self._settings.fills:  # strands that fill a card leave no gaps
            across += (self._random.random(count) - 0.5) * (_JITTER / count)
        flat = chart.places[piece.topology.triangles]
        card = Card(chart, flat, piece.faces, widths, across, card_lines.straight_lines(chart, widths, across))
        self.cards.append(card)
        self._parts.append(card)

    def _add_lock(self, piece, points, count):
        uvs = self._piece_uvs(piece)
        sections = lock_sections.sections_of(piece.topology, points, self._root_first(self._away[piece.vertices], uvs))
        if sections is None:
            self._skipped += 1
            return
        turn = self._random.random() * 2.0 * np.pi
        order = np.arange(count)
        radii = sections.sizes / np.sqrt(count)
        if self._settings.fills and count > 1:
            # Enough strands along the rim for a smooth outline; most of their radius lies inside.
            rim = round(_RIM * np.sqrt(count))
            out, inset = np.sqrt((order + 0.5) / max(count - 0.5 * (rim + 1), 0.5)), _INSET * radii
            out[order >= count - rim] = 1.0
        else:
            out, inset = np.sqrt(order / count), 0.0 * radii
        across = np.stack([turn + order * _GOLDEN, np.minimum(out, 1.0)], axis=1)
        found, vertices = sections.places(across, inset)
        corners = np.empty(len(piece.vertices), np.int64)
        triangle, corner = np.nonzero(piece.first_corners)
        corners[piece.topology.triangles[triangle, corner]] = 3 * piece.faces[triangle] + corner
        self._parts.append(_Lock(count, radii, found.reshape(-1, 3), corners[vertices].ravel()))

    def _piece_uvs(self, piece):
        """Return UV coordinates (v, 2) of a piece's vertices, or None."""
        if self._uvs is None:
            return None
        found = np.empty((len(piece.vertices), 2))
        triangle, corner = np.nonzero(piece.first_corners)
        found[piece.topology.triangles[triangle, corner]] = self._uvs[piece.faces[triangle], corner]
        return found

    def _root_first(self, away, uvs):
        """Return the function of two ends and a length that decides which end is the root."""
        root_end = self._settings.root_end

        def is_first(first, second, length):
            if root_end != "SURFACE":
                low, high = uvs[first, 1].mean(), uvs[second, 1].mean()
                return None if low == high else bool((low < high) == (root_end == "LOW_V"))
            near, far = away[first].mean(), away[second].mean()
            return bool(near < far) if abs(near - far) > _CLEAR * length else None

        return is_first

    def _on_charts(self):
        """Return (points (Q, 3), faces (Q,), barycentric (Q, 3)) of the queries on all charts."""
        if not self.cards:
            return np.zeros((0, 3)), np.zeros(0, int), np.zeros((0, 3))
        found = card_lines.located([card.flat for card in self.cards], [card.lines.queries for card in self.cards])
        on_mesh = np.concatenate([card.faces[places[0]] for card, places in zip(self.cards, found, strict=True)])
        weights = np.concatenate([places[1] for places in found]).astype(np.float64)
        corners = self._vertices[self._mesh.triangles[on_mesh]]
        return np.einsum("qc,qci->qi", weights, corners), on_mesh, weights


def _is_closed_at_tip(topology, points):
    """Whether a piece with one boundary is a tube with a closed tip instead of a card."""
    if len(topology.loops) != 1:
        return True
    loop = points[topology.loops[0]]
    if len(loop) == len(points):  # the boundary has all vertices
        return False
    length = np.linalg.norm(np.diff(loop, axis=0, append=loop[:1]), axis=1).sum()
    return np.linalg.norm(points - loop.mean(axis=0), axis=1).max() > 0.5 * length


def _distances(surface, points):
    """Return distances (N,) [m] of points to a surface."""
    near = positions(surface, SurfaceQuery(surface).nearest(points))
    return np.linalg.norm(points.astype(np.float64) - near, axis=1)
