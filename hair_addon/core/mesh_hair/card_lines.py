# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of strands on the flat charts of cards, from root to tip."""

from dataclasses import dataclass

import numpy as np

from ..geometry.closest_point import SurfaceQuery
from ..geometry.mesh import TriMesh
from . import alpha_paths, ribbon_charts

ROWS = 64  # rows in which a card's texture is sampled
LEAST_SHOWN = 0.25  # part of a strand that must be opaque

_LAYER = 4.0  # distance between charts: places on one are never closest to another


@dataclass(frozen=True)
class Lines:
    """Strands on a card's chart: queries (Q, 2) across and along, counts of strands' points, and radii (Q,) [m]."""

    queries: np.ndarray
    counts: np.ndarray
    radii: np.ndarray

    @classmethod
    def none(cls) -> "Lines":
        """Return no strands."""
        return cls(np.zeros((0, 2)), np.zeros(0, np.int64), np.zeros(0))


@dataclass
class Card:
    """A card: its `Layout`, corners (f, 3, 2) of its triangles on the chart, their faces (f,) of the mesh, widths [m]
    at stations, and places across and lines of its strands.
    """

    chart: ribbon_charts.Layout
    flat: np.ndarray
    faces: np.ndarray
    widths: np.ndarray
    across: np.ndarray
    lines: Lines

    @property
    def count(self) -> int:
        """The number of strands."""
        return len(self.across)


def straight_lines(chart: ribbon_charts.Layout, widths: np.ndarray, across: np.ndarray) -> Lines:
    """Return the `Lines` of strands at places `across` (n,) of a card; widths: [m] at its stations."""
    count = len(across)
    queries = chart.queries(across[:, None], chart.stations[None])
    return Lines(queries, np.full(count, len(chart.stations)), np.tile(widths / (2.0 * count), count))


def lines_along(chart: ribbon_charts.Layout, widths: np.ndarray, paths: alpha_paths.Paths, is_own: np.ndarray) -> Lines:
    """Return the `Lines` of a card along its own ones of S paths; short ones are left out.

    widths: [m] at the card's stations; is_own: (S,) bool.
    """
    first, last = paths.first[is_own], paths.last[is_own]
    is_long = last - first + 1 >= LEAST_SHOWN * ROWS
    first, last = first[is_long] / ROWS, (last[is_long] + 1) / ROWS
    if not len(first):
        return Lines.none()
    inner = _between(chart.stations)
    along = np.clip(inner, first[:, None], last[:, None])
    # Stations beyond an end of a strand are replaced by this end, once.
    keeps = np.ones(along.shape, bool)
    keeps[:, 1:-1] = (inner[1:-1] > first[:, None]) & (inner[1:-1] < last[:, None])
    rows = along * ROWS - 0.5
    low = np.clip(rows.astype(int), 0, ROWS - 2)
    share, strand = np.clip(rows - low, 0.0, 1.0), np.arange(len(along))[:, None]
    across, covered = (
        (1.0 - share) * values[is_own][is_long][strand, low] + share * values[is_own][is_long][strand, low + 1]
        for values in (paths.places, paths.widths)
    )
    radii = 0.5 * covered * np.interp(along, chart.stations, widths)
    return Lines(chart.queries(across, along)[keeps.ravel()], keeps.sum(axis=1), radii[keeps])


def _between(stations):
    """Return stations, divided until there are at least a third as many as rows."""
    parts = -(-(ROWS // 3) // (len(stations) - 1))
    at = np.arange((len(stations) - 1) * parts + 1) / parts
    return np.interp(at, np.arange(len(stations)), stations)


def located(charts: list[np.ndarray], queries: list[np.ndarray]) -> list[tuple[np.ndarray, np.ndarray]]:
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
