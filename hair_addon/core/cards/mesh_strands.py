# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of hair cards, tubes and solid locks → strands.

Strands of a card run from its root end to its tip end, spread over its width with random offsets unless they fill it,
along the opaque parts of its texture. Strands of a tube or
a lock are evenly distributed over its cross sections, on the spiral of [Vogel79]. Strands that fill a tube or a lock
with their radii are denser along its rim.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import HairError
from ..geometry.closest_point import SurfaceQuery
from ..geometry.mesh import SurfacePoints, TriMesh, normals, positions
from ..geometry.strands import curve_offsets
from ..long_work import Progress, no_progress, part_of
from . import alpha_paths, lock_sections, ribbon_charts
from .mesh_pieces import Piece, pieces_of
from .mesh_strand_settings import MOST_STRANDS, MeshStrandSettings

_CLEAR = 0.1  # difference of two ends' distances to the surface, relative to the length, that determines the root
_JITTER = 0.6  # of a strand's place, relative to the distance of strands across a card
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # [rad]
_RIM, _INSET = 2.0, 0.8  # number at the rim relative to the square root of all; inset relative to the radius
_OPAQUE = 0.5  # alpha above which a texture shows hair
_HALVINGS = 4  # bisections of the segment in which a texture ends
_LEAST_SHOWN = 0.25  # part of a strand that must be opaque
_REACH = 0.25  # distance of a root to the surface, relative to the strand's length, that is bridged
_TOUCHING = 1e-5  # distance of a root on the surface, relative to the strand's length
_INWARD = 0.2  # mean cosine between normals and the directions from the center, below which normals point inward
_ROWS = 64  # rows in which a card's texture is sampled
_CELLS, _FEWEST, _MOST = 2, 64, 256  # cells per strand in a row, and the smallest and largest number of cells
_BATCH = 1 << 15  # largest number of cells in a row of the cards that are followed together
_STEEP = 1.0  # sideways movement of the border of an opaque part, relative to the distance of rows: 45 degrees
_LAYER = 4.0  # distance between charts: places on one are never closest to another
_MOST_FACES = 20_000  # of a piece: larger pieces beside smaller pieces are bodies
_MOST_SCULPTED = 500_000  # of a piece, if all pieces are larger than `_MOST_FACES`; takes ten seconds


HIDDEN = "The texture of the hair mesh is transparent at all strands: turn off Use Alpha."


@dataclass(frozen=True)
class MeshStrands:
    """S strands with N points, from root to tip.

    points: (N, 3) float32 [m]; counts: (S,) of points; radii: (N,) float32 [m] with which strands fill their piece;
    places: N `SurfacePoints` on the hair mesh, for its textures; pieces: (S,) piece of each strand; piece_count: number
    of used pieces; skipped_count: number of pieces that are neither cards nor slender, or too large.
    """

    points: np.ndarray
    counts: np.ndarray
    radii: np.ndarray
    places: SurfacePoints
    pieces: np.ndarray
    piece_count: int
    skipped_count: int

    @property
    def starts(self) -> np.ndarray:
        """(S+1,) offsets of each strand's points."""
        return curve_offsets(self.counts)

    def some(self, is_chosen: np.ndarray) -> "MeshStrands":
        """Return the strands with the chosen points; strands with fewer than two are left out; is_chosen: (N,) bool."""
        left = np.add.reduceat(is_chosen.astype(np.int64), self.starts[:-1])
        rows = is_chosen & np.repeat(left >= 2, self.counts)
        return replace(
            self,
            points=self.points[rows],
            counts=left[left >= 2],
            radii=self.radii[rows],
            places=self.places[rows],
            pieces=self.pieces[left >= 2],
        )


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
        maker.follow_textures(alpha_at, part_of(progress, 0.4, 0.8))
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
class _Lines:
    """Strands on a card's chart: queries (Q, 2) across and along, counts of strands' points, and radii (Q,) [m]."""

    queries: np.ndarray
    counts: np.ndarray
    radii: np.ndarray

    @classmethod
    def none(cls):
        return cls(np.zeros((0, 2)), np.zeros(0, np.int64), np.zeros(0))


@dataclass
class _Card:
    """A card: its `Layout`, corners (f, 3, 2) of its triangles on the chart, their faces (f,) of the mesh, widths [m]
    at stations, and places across and lines of its strands.
    """

    chart: ribbon_charts.Layout
    flat: np.ndarray
    faces: np.ndarray
    widths: np.ndarray
    across: np.ndarray
    lines: _Lines

    @property
    def count(self):
        return len(self.across)


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
        self._cards: list[_Card] = []
        self._parts: list[_Card | _Lock] = []
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

    def follow_textures(self, alpha_at: Callable[[SurfacePoints], np.ndarray], progress: Progress) -> None:
        """Replace the lines of cards with transparent parts by lines along the opaque parts."""
        groups: dict[int, list[_Card]] = {}
        for card in self._cards:
            cells = 1 << int(np.ceil(np.log2(_CELLS * card.count)))
            groups.setdefault(min(max(cells, _FEWEST), _MOST), []).append(card)
        done = 0
        for cells, cards in groups.items():
            size = max(_BATCH // cells, 1)
            for first in range(0, len(cards), size):
                progress("Following textures", done / len(self._cards))
                some = cards[first : first + size]
                self._follow_texture_of(some, cells, alpha_at)
                done += len(some)

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
            if isinstance(part, _Card):
                rows = slice(used, used + len(part.lines.radii))
                found.append((points[rows], faces[rows], barycentric[rows], part.lines.radii, part.lines.counts))
                used = rows.stop
            else:
                weights = np.eye(3, dtype=np.float32)[part.corners % 3]
                counts = np.full(part.count, part.stations)
                found.append((part.points, part.corners // 3, weights, np.tile(part.radii, part.count), counts))
        merged = [np.concatenate(rows) for rows in zip(*found, strict=True)]
        if not len(merged[4]):
            raise HairError(HIDDEN)
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
        card = _Card(chart, flat, piece.faces, widths, across, _straight(chart, widths, across))
        self._cards.append(card)
        self._parts.append(card)

    def _follow_texture_of(self, cards, cells, alpha_at):
        """Replace the lines of cards, each with rows of some number of cells."""
        across, along = (np.arange(cells) + 0.5) / cells, (np.arange(_ROWS) + 0.5) / _ROWS
        shape = len(cards), _ROWS, cells
        layouts = {id(card.chart): card for card in cards}
        on_layouts = _located(
            [card.flat for card in layouts.values()],
            [card.chart.queries(across[None], along[:, None]) for card in layouts.values()],
        )
        grids = dict(zip(layouts, on_layouts, strict=True))
        places = SurfacePoints(
            np.concatenate([card.faces[grids[id(card.chart)][0]] for card in cards]).astype(np.int32),
            np.concatenate([grids[id(card.chart)][1] for card in cards]),
        )
        opaque = alpha_at(places).reshape(shape) >= _OPAQUE
        measured = np.arange(len(places)).reshape(shape)[:, :, [0, cells // 2, -1]]
        points = positions(self._mesh, places[measured.ravel()]).astype(np.float64).reshape(len(cards), _ROWS, 3, 3)
        widths = np.linalg.norm(points[:, 1:, 2] - points[:, 1:, 0], axis=2) / (cells - 1)
        steps = np.linalg.norm(np.diff(points[:, :, 1], axis=1), axis=2)
        steepness = np.maximum(_STEEP * steps / np.maximum(widths, 1e-30), 1.0)
        is_shown = opaque.any(axis=(1, 2))
        for card, is_any in zip(cards, is_shown, strict=True):
            if not is_any:
                card.lines = _Lines.none()
        chosen = np.flatnonzero(is_shown & ~opaque.all(axis=(1, 2)))
        if not len(chosen):
            return
        owners = np.repeat(np.arange(len(chosen)), [cards[place].count for place in chosen])
        starts = np.concatenate([cards[place].across for place in chosen])
        paths = alpha_paths.traced(opaque[chosen], steepness[chosen], owners, starts)
        if not self._settings.fills:  # strands that fill a card reach the borders of its opaque parts
            paths = alpha_paths.inside(paths, opaque[chosen], owners)
        for number, place in enumerate(chosen):
            cards[place].lines = _along(cards[place].chart, cards[place].widths, paths, owners == number)

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
        if not self._cards:
            return np.zeros((0, 3)), np.zeros(0, int), np.zeros((0, 3))
        found = _located([card.flat for card in self._cards], [card.lines.queries for card in self._cards])
        on_mesh = np.concatenate([card.faces[places[0]] for card, places in zip(self._cards, found, strict=True)])
        weights = np.concatenate([places[1] for places in found]).astype(np.float64)
        corners = self._vertices[self._mesh.triangles[on_mesh]]
        return np.einsum("qc,qci->qi", weights, corners), on_mesh, weights


def _located(charts, queries):
    """Return [(triangles (Q,), barycentric (Q, 3) float32)] of queries [(Q, 2)] on charts [(f, 3, 2)]."""
    layers = np.repeat(_LAYER * np.arange(len(charts)), [len(chart) for chart in charts])
    corners = np.concatenate(charts)
    flat = np.concatenate([corners, np.broadcast_to(layers[:, None, None], (len(corners), 3, 1))], 2)
    layout = TriMesh(flat.reshape(-1, 3).astype(np.float32), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3))
    counts = [len(query) for query in queries]
    heights = np.repeat(_LAYER * np.arange(len(charts)), counts)
    asked = np.concatenate([np.concatenate(queries), heights[:, None]], axis=1).astype(np.float32)
    found = SurfaceQuery(layout).nearest(asked)
    firsts = np.repeat(np.cumsum([0] + [len(chart) for chart in charts[:-1]]), counts)
    ends = np.cumsum(counts)[:-1]
    return list(zip(np.split(found.triangle - firsts, ends), np.split(found.barycentric, ends), strict=True))


def _straight(chart, widths, across):
    """Return the `_Lines` of strands (n,) across a card, without a texture."""
    count = len(across)
    queries = chart.queries(across[:, None], chart.stations[None])
    return _Lines(queries, np.full(count, len(chart.stations)), np.tile(widths / (2.0 * count), count))


def _along(chart, widths, paths, is_own):
    """Return the `_Lines` of a card along its paths; is_own: (S,) of all paths. Short ones are left out."""
    first, last = paths.first[is_own], paths.last[is_own]
    is_long = last - first + 1 >= _LEAST_SHOWN * _ROWS
    first, last = first[is_long] / _ROWS, (last[is_long] + 1) / _ROWS
    if not len(first):
        return _Lines.none()
    inner = _between(chart.stations)
    along = np.clip(inner, first[:, None], last[:, None])
    # Stations beyond an end of a strand are replaced by this end, once.
    keeps = np.ones(along.shape, bool)
    keeps[:, 1:-1] = (inner[1:-1] > first[:, None]) & (inner[1:-1] < last[:, None])
    rows = along * _ROWS - 0.5
    low = np.clip(rows.astype(int), 0, _ROWS - 2)
    share, strand = np.clip(rows - low, 0.0, 1.0), np.arange(len(along))[:, None]
    across, covered = (
        (1.0 - share) * values[is_own][is_long][strand, low] + share * values[is_own][is_long][strand, low + 1]
        for values in (paths.places, paths.widths)
    )
    radii = 0.5 * covered * np.interp(along, chart.stations, widths)
    return _Lines(chart.queries(across, along)[keeps.ravel()], keeps.sum(axis=1), radii[keeps])


def _between(stations):
    """Return stations, divided until there are at least a third as many as rows."""
    parts = -(-(_ROWS // 3) // (len(stations) - 1))
    at = np.arange((len(stations) - 1) * parts + 1) / parts
    return np.interp(at, np.arange(len(stations)), stations)


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


def shown(
    strands: MeshStrands, alpha: np.ndarray, alpha_at: Callable[[SurfacePoints], np.ndarray], mesh: TriMesh
) -> MeshStrands:
    """Return strands that end where a texture becomes transparent, without mostly transparent strands.

    alpha: (N,) in [0, 1] at the points; alpha_at: a function that returns it at places on the hair mesh. Raises
    `HairError` if no strand is left.
    """
    is_shown, starts = alpha >= _OPAQUE, strands.starts[:-1]
    place = np.arange(len(alpha)) - np.repeat(starts, strands.counts)
    last = np.maximum.reduceat(np.where(is_shown, place, -1), starts)
    parts = np.add.reduceat(is_shown.astype(np.float64), starts) / strands.counts
    last[parts < _LEAST_SHOWN] = -1
    is_cut = (last >= 0) & (last < strands.counts - 1)
    cut = _cut(strands, (starts + last)[is_cut], alpha_at, mesh)
    found = cut.some(place <= np.repeat(last + is_cut, strands.counts))
    if not len(found.counts):
        raise HairError(HIDDEN)
    return found


def _cut(strands, rows, alpha_at, mesh):
    """Return strands with the points after `rows` (M,) moved back to the end of the texture.

    Between two points, the plane and the UV coordinates of the first point's triangle are extended.
    """
    first, second = (strands.points[at].astype(np.float64) for at in (rows, rows + 1))
    triangle = strands.places.triangle[rows]
    corners = mesh.vertices.astype(np.float64)[mesh.triangles[triangle]]
    axes = corners[:, 1:] - corners[:, :1]
    low, high = np.zeros(len(rows)), np.ones(len(rows))
    barycentric = strands.places.barycentric[rows].astype(np.float64)
    across = np.einsum("mki,mji->mkj", axes, axes)
    shares = np.einsum("mki,mi->mk", axes, second - first)
    steps = np.einsum("mkj,mj->mk", np.linalg.pinv(across, hermitian=True), shares)
    steps = np.concatenate([-steps.sum(axis=1, keepdims=True), steps], axis=1)
    for _halving in range(_HALVINGS):
        middle = 0.5 * (low + high)
        places = SurfacePoints(triangle, (barycentric + middle[:, None] * steps).astype(np.float32))
        is_opaque = alpha_at(places) >= _OPAQUE
        low, high = np.where(is_opaque, middle, low), np.where(is_opaque, high, middle)
    points, radii = strands.points.copy(), strands.radii.copy()
    triangles, weights = strands.places.triangle.copy(), strands.places.barycentric.copy()
    # A minimum distance, so that no segment has zero length.
    low = np.maximum(low, 0.5**_HALVINGS)
    points[rows + 1] = first + low[:, None] * (second - first)
    radii[rows + 1] = strands.radii[rows] + low * (strands.radii[rows + 1] - strands.radii[rows])
    triangles[rows + 1], weights[rows + 1] = triangle, strands.places.barycentric[rows]  # an opaque place
    return replace(strands, points=points, radii=radii, places=SurfacePoints(triangles, weights))


def on_surface(strands: MeshStrands, surface: TriMesh) -> MeshStrands:
    """Return strands that begin on a surface [m]: cut where they leave it, or extended from the closest point.

    Strands that begin far from it, or stay inside, do not change. Normals that point inward
    count as if they pointed outward.
    """
    query, starts = SurfaceQuery(surface), strands.starts
    points = strands.points.astype(np.float64)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    steps[starts[1:-1] - 1] = 0.0
    lengths = np.add.reduceat(np.append(steps, 0.0), starts[:-1])
    heights = _outward(surface) * _heights(query, surface, points)
    place = np.arange(len(points)) - np.repeat(starts[:-1], strands.counts)
    is_out = (heights > 0.0) & (place <= np.repeat(strands.counts // 2, strands.counts))
    first = np.minimum.reduceat(np.where(is_out, place, len(points)), starts[:-1])
    is_cut = (first > 0) & (first < len(points))
    at = starts[:-1] + np.where(is_cut, first, 0)
    before = at - is_cut
    share = np.where(is_cut, heights[before] / np.where(is_cut, heights[before] - heights[at], 1.0), 0.0)[:, None]
    leaving = points[before] + share * (points[at] - points[before])
    roots = positions(surface, query.nearest(leaving)).astype(np.float64)
    apart = np.linalg.norm(roots - points[at], axis=1)
    is_outside = first < len(points)
    is_extended = is_outside & (apart > _TOUCHING * lengths)
    is_extended &= (np.linalg.norm(roots - leaving, axis=1) <= _REACH * lengths) & (lengths > 0.0)
    # The last point of a cut strand inside the surface becomes its root; other strands get a new first point.
    is_new = is_extended & ~is_cut
    keeps = place >= np.repeat(np.where(is_cut & is_extended, first - 1, 0), strands.counts)
    moved = strands.points.copy()
    moved[before[is_extended & is_cut]] = roots[is_extended & is_cut]
    kept = replace(strands, points=moved)
    if not keeps.all():
        kept = kept.some(keeps)
    order = np.repeat(np.arange(len(kept.points)), 1 + _firsts(kept, is_new))
    grown = replace(
        kept,
        points=kept.points[order],
        counts=kept.counts + is_new,
        radii=kept.radii[order],
        places=kept.places[order],
    )
    grown.points[grown.starts[:-1][is_new]] = roots[is_new]
    return grown


def _firsts(strands, is_chosen):
    found = np.zeros(len(strands.points), int)
    found[strands.starts[:-1][is_chosen]] = 1
    return found


def _outward(surface):
    """Return -1 for a surface whose normals point inward, such as a mirrored mesh, else 1."""
    away = surface.corners.mean(axis=1) - np.average(
        surface.corners.mean(axis=1), axis=0, weights=surface.areas + 1e-30
    )
    facing = 0.5 * np.einsum("fi,fi->f", away, surface.scaled_normals)
    reach = np.linalg.norm(away, axis=1) @ surface.areas
    return -1.0 if facing.sum() < -_INWARD * reach else 1.0


def _heights(query, surface, points):
    """Return heights (N,) [m] above a surface, negative inside."""
    near = query.nearest(points)
    return np.einsum("ni,ni->n", points - positions(surface, near), normals(surface, near))


def root_to_tip_means(strands: MeshStrands, values: np.ndarray) -> np.ndarray:
    """Return means (S, C) of values (N, C) over the points of each strand."""
    return np.add.reduceat(values, strands.starts[:-1], axis=0) / strands.counts[:, None]
