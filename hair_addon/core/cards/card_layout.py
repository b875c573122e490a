# SPDX-License-Identifier: GPL-3.0-or-later
"""Placement of cards: clumps of strands, crossed cards, flyaways and caps, with their mesh and pictures."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ..geometry.mesh import TriMesh
from ..geometry.search import clusters, hash_grid
from ..long_work import Progress, no_progress
from . import atlas, outlines, ribbons
from .card_settings import CardSettings, Level
from .nearest_triangles import NONE, Samples
from .polygon_mesh import PolygonMesh
from .texels import NO_STRAND, PlacedStrands

_CAP_REACH = 0.25  # part of the strands, from the root, on cards that lie on the surface
_FEW = 8  # number of lines that each line is compared with first, including its own
_AT_ONCE = 100_000  # pairs of lines in a batch
_TINY = 1e-6  # [m]


@dataclass(frozen=True, eq=False)
class Clumps:
    """The division of S strands into clumps, each with a card.

    labels: (S,) int32 clump of each strand, -1 for flyaways; every clump has strands; crossed: (K,) ascending indices
    of the clumps with a second card.
    """

    labels: np.ndarray
    crossed: np.ndarray

    @property
    def count(self) -> int:
        """Number of clumps."""
        return int(self.labels.max()) + 1


@dataclass(frozen=True)
class Placement:
    """Parameters of the placement of cards; the error measure chooses among several.

    outward: weight of facing away from the surface, relative to following the spread of a clump; tip: weight of the
    distances between tips in the division into clumps, relative to those between roots; clumps: replace the clumps
    of `clumps_of`.
    """

    outward: float = 2.0
    tip: float = 1.0
    clumps: Clumps | None = None


@dataclass(frozen=True)
class CardStrands:
    """Strands that become cards: points (S, P, 3), radii (S, P), linear colors (S, P, 3); surface: in their space.

    roughness: (S,), None if it does not vary.
    """

    points: np.ndarray
    radii: np.ndarray
    colors: np.ndarray
    surface: TriMesh
    roughness: np.ndarray | None = None


@dataclass(frozen=True)
class Laid:
    """Cards before their textures are drawn: mesh beside the surface, strands in the texture, number of pictures."""

    mesh: PolygonMesh
    strands: PlacedStrands
    picture_count: int


@dataclass(frozen=True)
class _Pieces:
    """Strands or parts of strands on cards: N pieces for M cards; a strand can have several.

    strands: (N,) index; reaches: (N,) part of its length, from the root; labels: (N,) card; axes: of the cards.
    """

    strands: np.ndarray
    reaches: np.ndarray
    labels: np.ndarray
    axes: ribbons.Axes


def laid_cards(
    strands: CardStrands,
    level: Level,
    settings: CardSettings,
    placement: Placement,
    progress: Progress = no_progress,
) -> Laid:
    """Return the cards of a level with at most as many cards as strands. Raises `HairError`.

    settings: number of pictures, and parts of the cards that are crossed, flyaways or caps.
    """
    pieces = _pieces(strands, level, settings, placement, progress)
    progress("Making cards", 1.0)
    shown = [_cut(values[pieces.strands], pieces.reaches) for values in _of_points(strands)]
    lines, widths, shades = shown[0], shown[1][..., 0], shown[2]
    labels, count = pieces.labels, level.card_count
    flat = ribbons.flattened(lines, labels, pieces.axes)
    found = outlines.outlines(flat, widths, labels, pieces.axes)
    lifted = outlines.heights(flat, labels, found)
    flat = outlines.levelled(flat, labels, found, lifted)
    sizes = np.bincount(labels, minlength=count)
    places = atlas.atlas(found, sizes, settings.picture_count, level.texture_size)
    chosen, flat_lines, flat_radii = places.placed(flat, widths, labels, found.boxes)
    heights = float(flat_lines[..., 2].min()), float(flat_lines[..., 2].max())
    ids = np.random.default_rng(0).permutation(len(chosen)) / max(len(chosen) - 1, 1)
    reaches = pieces.reaches[chosen].astype(np.float32)
    roughness = None if strands.roughness is None else strands.roughness[pieces.strands[chosen]]
    placed = PlacedStrands(flat_lines, flat_radii, shades[chosen], ids.astype(np.float32), heights, reaches, roughness)
    return Laid(outlines.ribbon_mesh(pieces.axes, found, places.uvs(found), lifted), placed, len(places.shown))


def _of_points(strands):
    """Return points, radii and colors (S, P, k)."""
    return strands.points, strands.radii[..., None], strands.colors


def clumps_of(
    strands: CardStrands,
    level: Level,
    settings: CardSettings,
    placement: Placement,
    progress: Progress = no_progress,
) -> Clumps:
    """Return the clumps of similar strands for the cards of a level; the thickest clumps get a second card."""
    points = strands.points
    crossed, flyaways, caps = settings.parts_of(level.card_count)
    count = level.card_count - crossed - flyaways - caps
    features = clusters.strand_features(points)
    features[:, 3:] *= np.linspace(1.0, placement.tip, 4)[1:].repeat(3).astype(np.float32)
    labels, everywhere = np.full(len(points), -1, np.int32), np.arange(len(points))
    loose = _outermost(points, features, count, flyaways) if flyaways else everywhere[:0]
    inner = np.setdiff1d(everywhere, loose)
    labels[inner] = clusters.clusters(features[inner], count, progress)
    thickest = everywhere[:0]
    if crossed:
        axes = _axes(points, Clumps(labels, thickest), level, strands.surface, placement)
        thickest = _thickest(points[inner], labels[inner], axes, crossed)
    return Clumps(labels, thickest)


def _axes(points, clumps, level, surface, placement):
    inner = clumps.labels >= 0
    parts = points[inner], clumps.labels[inner], clumps.count, level.segment_count
    return ribbons.axes_of(*parts, surface, placement.outward)


def _pieces(strands, level, settings, placement, progress):
    """Return the `_Pieces` of strands on clumps, crossed cards, flyaways and cards on the surface, in this order."""
    points, surface = strands.points, strands.surface
    caps = settings.parts_of(level.card_count)[2]
    clumps = placement.clumps or clumps_of(strands, level, settings, placement, progress)
    inner, loose = (np.flatnonzero(chosen) for chosen in (clumps.labels >= 0, clumps.labels < 0))
    parts = [(inner, clumps.labels[inner], _axes(points, clumps, level, surface, placement), 1.0)]
    if len(clumps.crossed):
        parts.append(_second(parts[0], clumps.crossed))
    if len(loose):
        parts.append(_ribbons(points, loose, np.arange(len(loose)), level, surface, 1.0))
    if caps:
        roots = _cut(points, np.full(len(points), _CAP_REACH))
        of_caps = clusters.clusters(clusters.strand_features(roots), caps)
        parts.append(_ribbons(roots, np.arange(len(points)), of_caps, level, surface, _CAP_REACH))
    firsts = np.cumsum([0] + [len(part[2].centres) for part in parts])
    return _Pieces(
        np.concatenate([part[0] for part in parts]),
        np.concatenate([np.full(len(part[0]), part[3]) for part in parts]),
        np.concatenate([part[1] + first for part, first in zip(parts, firsts, strict=False)]),
        ribbons.joined([part[2] for part in parts]),
    )


def _ribbons(lines, strands, labels, level, surface, reach):
    """Return (strands, labels, axes, reach) of cards for parts of strands; lines: points of all strands."""
    count = int(labels.max()) + 1
    return strands, labels, ribbons.axes_of(lines[strands], labels, count, level.segment_count, surface), reach


def _outermost(points, features, clump_count, count):
    """Return indices (count,), ascending, of the strands farthest from the middle of the other strands near them."""
    labels = clusters.clusters(features, clump_count)
    middles, sizes = clusters.cluster_means(points, labels, clump_count), np.bincount(labels)
    away = np.linalg.norm(points - middles[labels], axis=-1).mean(axis=1)
    away *= sizes[labels] / np.maximum(sizes[labels] - 1, 1)  # distance from the middle of the other strands
    alone = np.flatnonzero(sizes[labels] == 1) if clump_count > 1 else np.zeros(0, int)
    if len(alone):
        away[alone] = _nearest_others(points[alone], middles, labels[alone])
    return np.sort(np.argsort(-away, kind="stable")[:count])


def _nearest_others(lines, middles, own):
    """Return the mean distance (N,) of each line (N, P, 3) from the nearest of middles (C, P, 3) except its own (N,).

    The distance of two lines is at least the distance of their centers. So each line is compared with the middles whose
    centers are nearest, and with more of them only while another one may be nearer.
    """
    centers = middles.mean(axis=1)
    origin = centers.mean(axis=0)
    targets = wp.array((centers - origin).astype(np.float32), dtype=wp.vec3, device="cpu")
    extent = max(2.0 * float(np.linalg.norm(centers - origin, axis=1).max()), _TINY)
    found, rest, count = np.full(len(lines), np.inf), np.arange(len(lines)), _FEW
    while len(rest):
        count = min(count, len(middles), hash_grid.LIMIT)
        places = wp.array((centers[own[rest]] - origin).astype(np.float32), dtype=wp.vec3, device="cpu")
        near, apart = (rows.numpy() for rows in hash_grid.neighbours(targets, places, extent, count))
        for rows in np.array_split(np.arange(len(rest)), -(-near.size // _AT_ONCE)):
            away = _distances(lines[rest[rows], None], middles[near[rows]])
            away[(near[rows] == own[rest[rows], None]) | (near[rows] < 0)] = np.inf
            found[rest[rows]] = away.min(axis=1)
        if count == len(middles):
            break
        rest = rest[found[rest] > 0.9999 * apart[:, -1]]
        if count == hash_grid.LIMIT:
            for line in rest:
                away = _distances(lines[line], middles)
                away[own[line]] = np.inf
                found[line] = away.min()
            break
        count *= 4
    return found


def _distances(line, lines):
    """Return mean distances (..., N) between the points of a line (..., P, 3) and those of lines (..., N, P, 3)."""
    return np.linalg.norm(line - lines, axis=-1).mean(axis=-1)


def _thickest(points, labels, axes, count):
    """Return the ascending indices (count,) of the clumps with the most spread along the normals of their cards."""
    flat = ribbons.flattened(points, labels, axes).astype(np.float64)
    thickness = clusters.cluster_means((flat[..., 2] ** 2).mean(axis=1), labels, len(axes.centres))
    return np.sort(np.argsort(-thickness, kind="stable")[:count])


def _second(part, crossed):
    """Return (strands, labels, axes, reach) of second cards, at right angles to the first; crossed: their clumps."""
    strands, labels, axes, reach = part
    card = np.full(len(axes.centres), -1)
    card[crossed] = np.arange(len(crossed))
    members = np.flatnonzero(card[labels] >= 0)
    turned = axes.chosen(crossed).turned(np.full(len(crossed), 0.5 * np.pi))
    return strands[members], card[labels[members]], turned, reach


def _cut(values, reaches):
    """Return values (N, P, k) of points resampled to P points along the first parts (N,) of the strands."""
    if (reaches == 1.0).all():
        return values
    last = values.shape[1] - 1
    at = np.linspace(0.0, last, last + 1) * np.asarray(reaches)[:, None]
    low = np.minimum(at.astype(int), last - 1)
    part = (at - low)[..., None].astype(values.dtype)
    rows = np.arange(len(values))[:, None]
    return values[rows, low] * (1.0 - part) + values[rows, low + 1] * part


def texture_segments(strands: PlacedStrands, size: int, per_side: int) -> np.ndarray:
    """Return the segment that each sample (size · per_side, size · per_side) of a texture shows, or `NO_STRAND`.

    A segment has the index strand · (P - 1) + piece; the highest strand is visible.
    """
    side = size * per_side
    low, high = strands.heights
    places = strands.places.astype(np.float64)
    places[..., 2] = (high - places[..., 2]) / max(high - low, 1e-12) / side
    flat = places * [1.0, 1.0, 0.0]
    edges = np.diff(flat, axis=1)
    across = np.stack([-edges[..., 1], edges[..., 0], np.zeros(edges.shape[:2])], axis=-1)
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-18)
    here, there = (radii[..., None] * across for radii in (strands.radii[:, :-1], strands.radii[:, 1:]))
    first, second = places[:, :-1], places[:, 1:]
    quads = np.stack([first - here, first + here, second + there, second - there], axis=2) * side
    samples = Samples(side)
    samples.add(quads[:, :, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3))
    seen = samples.triangles()
    return np.where(seen == NONE, NO_STRAND, seen // 2)
