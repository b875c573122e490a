# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat charts of cards: a coordinate across and a coordinate from root to tip at each vertex.

Boundaries are mapped to a convex polygon. Inner vertices are at the mean of their neighbors [Tutte63], so that no face
folds over.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .mesh_pieces import Topology

_STRAIGHT = 0.76  # cosine of the turn of a boundary, 40°, above which it has no corner
_RECTANGULAR = 0.9  # area of a rectangular UV island relative to its bounding box
_LONG = 1.5  # ratio of sides above which the longer sides run from root to tip
_MOST_STATIONS = 64
LEAST_STATIONS = 8
_SMALL = 2_000  # maximum number of inner vertices of pieces whose places are exact to rounding
_EXACT, _CLOSE = 1e-26, 1e-18  # squared residuals at which the solution of small and large pieces ends


@dataclass(frozen=True)
class Layout:
    """Coordinates (v, 2) float64 of a card's vertices: across, and along from the root at 0 to the tip at 1.

    rows: places along of the vertices of the left and the right side; stations: (K,) places along; left, right: (K,)
    coordinates across of the sides there.
    """

    places: np.ndarray
    rows: list[np.ndarray]
    stations: np.ndarray
    left: np.ndarray
    right: np.ndarray

    def queries(self, across: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Return coordinates (Q, 2) of places across the card, from 0 to 1 between its sides, and along it."""
        left, right = (np.interp(along, self.stations, side) for side in (self.left, self.right))
        place = left + across * (right - left)
        return np.stack([place, np.broadcast_to(along, place.shape)], axis=-1).reshape(-1, 2)


class Charts:
    """Charts of cards, which share the layouts of cards with the same faces."""

    def __init__(self) -> None:
        self._layouts: dict[tuple, Layout] = {}

    def chart(
        self,
        topology: Topology,
        points: np.ndarray,
        uvs: np.ndarray | None,
        away: np.ndarray,
        root_first: Callable[[np.ndarray, np.ndarray, float], bool | None],
    ) -> tuple[Layout, np.ndarray]:
        """Return (`Layout`, (K,) widths [m] at its stations) of a card with one boundary loop.

        points: (v, 3) [m]; uvs: (v, 2) or None; away: (v,) [m] distances to the surface; root_first: a function of the
        vertices of two ends and the length between them [m] that returns whether the root is at the first end, None if
        unclear.
        """
        loop = topology.loops[0]
        edges = points[loop[_following(len(loop))]] - points[loop]
        lengths = np.sqrt(np.einsum("ni,ni->n", edges, edges))
        arc = np.concatenate([[0.0], np.cumsum(lengths)])
        corners = _rectangle(uvs[loop]) if uvs is not None else None
        if corners is None:
            corners = _sharp_corners(points[loop], edges / np.maximum(lengths, 1e-30)[:, None], arc)
        runs = _runs(loop, corners, arc, away)
        ends, sides = [runs[0][0], runs[2][0][::-1]], [runs[3][0][::-1], runs[1][0]]
        is_first = root_first(ends[0], ends[1], 0.5 * (runs[1][1] + runs[3][1]))
        if is_first is None:  # the wider end
            widths = runs[0][1], runs[2][1]
            is_first = widths[0] >= 0.95 * widths[1] or away[ends[0]].mean() < away[ends[1]].mean()
        if not is_first:
            ends, sides = ends[::-1], [side[::-1] for side in sides]
        layout = self._layout(topology, points, ends, sides)
        return layout, _widths(points, sides, layout)

    def _layout(self, topology, points, ends, sides):
        is_regular = len(sides[0]) == len(sides[1]) and len(ends[0]) == len(ends[1])
        key = (id(topology), *(run.tobytes() for run in (*ends, *sides)))
        if is_regular and key in self._layouts:
            return self._layouts[key]
        found = _layout_of(topology, points, ends, sides)
        if is_regular:
            self._layouts[key] = found
        return found


def _layout_of(topology, points, ends, sides):
    rows, columns = _rows(points, sides), _rows(points, ends)
    places = np.zeros((topology.vertex_count, 2))
    for end, along, across in zip(ends, (0.0, 1.0), columns, strict=True):
        places[end] = np.stack([across if len(end) > 1 else np.array([0.5]), np.full(len(end), along)], axis=1)
    for side, along, across in zip(sides, rows, (0.0, 1.0), strict=True):
        inner = slice(1 if len(ends[0]) == 1 else 0, -1 if len(ends[1]) == 1 else None)
        places[side[inner]] = np.stack([np.full(len(side), across), along], axis=1)[inner]
    places = _filled(topology, places)
    stations = _stations(np.concatenate(rows))
    left, right = (np.interp(stations, along, places[side, 0]) for side, along in zip(sides, rows, strict=True))
    return Layout(places, rows, stations, left, right)


def _widths(points, sides, layout):
    if len(sides[0]) == len(sides[1]):
        across = points[sides[1]] - points[sides[0]]
        return np.interp(layout.stations, layout.rows[0], np.sqrt(np.einsum("ni,ni->n", across, across)))
    edges = [_at(points[side], along, layout.stations) for side, along in zip(sides, layout.rows, strict=True)]
    return np.linalg.norm(edges[1] - edges[0], axis=1)


def _following(count):
    """Return the next place (count,) on a loop."""
    return np.append(np.arange(1, count), 0)


def _at(points, along, stations):
    return np.stack([np.interp(stations, along, points[:, axis]) for axis in range(3)], axis=1)


def _rows(points, lines):
    """Return places from 0 to 1 of the vertices of two lines; equal places if the lines have as many vertices."""
    if len(lines[0]) == len(lines[1]):
        return [np.linspace(0.0, 1.0, len(line)) for line in lines]
    return [_fractions(points[line]) for line in lines]


def _fractions(points):
    """Return arc lengths (n,) as parts of the whole; equal steps for a length of zero."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return arc / arc[-1] if arc[-1] > 0.0 else np.linspace(0.0, 1.0, len(points))


def _stations(rows):
    """Return rising places in [0, 1] with all rows, at least 8 and at most 64."""
    found = np.unique(np.round(rows, 9))
    if len(found) > _MOST_STATIONS:
        found = found[np.linspace(0, len(found) - 1, _MOST_STATIONS).astype(int)]
    return divided(found)


def divided(values: np.ndarray) -> np.ndarray:
    """Return rows (K, ...), at least 8, with equally many interpolated rows between each two values."""
    parts = -(-(LEAST_STATIONS - 1) // (len(values) - 1))
    if parts <= 1:
        return values
    at = np.arange((len(values) - 1) * parts + 1) / parts
    low = np.minimum(at.astype(int), len(values) - 2)
    share = (at - low).reshape(-1, *[1] * (values.ndim - 1))
    return (1.0 - share) * values[low] + share * values[low + 1]


def _rectangle(uvs):
    """Return the four corners of a boundary (n, 2) that is a rectangle in UV space, as rising indices; else None."""
    low, size = uvs.min(axis=0), np.ptp(uvs, axis=0)
    if not (size > 0.0).all():
        return None
    at = (uvs - low) / size
    after = np.roll(at, -1, axis=0)
    if 0.5 * abs((at[:, 0] * after[:, 1] - at[:, 1] * after[:, 0]).sum()) < _RECTANGULAR:
        return None
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    apart = np.abs(at[:, None] - square).max(axis=2)
    corners = np.sort(apart.argmin(axis=0))
    is_distinct = (np.diff(corners) > 0).all() and apart.min(axis=0).max() < 1.0 - _RECTANGULAR
    return corners if is_distinct else None


def _sharp_corners(points, directions, arc):
    """Return four rising indices of corners of a boundary; a pointed end has the same corner twice.

    points: (n, 3); directions: (n, 3) unit vectors to the next point; arc: (n + 1,) arc lengths.
    """
    cosines = np.einsum("ni,ni->n", directions[_following(len(points))], directions)  # at the next point
    sharp = np.sort(_following(len(points))[np.flatnonzero(cosines < _STRAIGHT)])
    if len(sharp) > 4:
        turns = cosines[sharp - 1]
        sharp = np.sort(sharp[np.argsort(turns, kind="stable")[:4]])
    if len(sharp) == 4:
        return sharp
    if len(sharp) == 3:
        gaps = np.append(np.diff(arc[sharp]), arc[-1] - arc[sharp[-1]] + arc[sharp[0]])
        pointed = sharp[(gaps.argmin() + 2) % 3]
        return np.sort(np.append(sharp, pointed))
    if len(sharp) == 2:
        gap = arc[sharp[1]] - arc[sharp[0]]
        if min(gap, arc[-1] - gap) < 0.6 * max(gap, arc[-1] - gap):  # a straight end, and a round one
            farthest = _farthest(points, points[sharp].mean(axis=0))
            return np.sort(np.concatenate([sharp, [farthest, farthest]]))
        return np.repeat(sharp, 2)
    first = sharp[0] if len(sharp) else _farthest(points, points[0])
    return np.repeat(np.sort([first, _farthest(points, points[first])]), 2)


def _farthest(points, place):
    return int(np.linalg.norm(points - place, axis=1).argmax())


def _runs(loop, corners, arc, away):
    """Return [(vertices, length)] of the four parts of a boundary: an end, a side, the other end, the other side."""
    firsts = corners.tolist()
    runs = []
    for place in range(4):
        first, last = firsts[place], firsts[(place + 1) % 4]
        vertices = loop[(first + np.arange((last - first) % len(loop) + 1)) % len(loop)]
        runs.append((vertices, (arc[last] - arc[first]) % arc[-1]))
    pairs = runs[0][1] + runs[2][1], runs[1][1] + runs[3][1]
    is_turned = pairs[0] > pairs[1]  # the first pair is long
    if len(set(firsts)) < 4:  # pointed ends
        is_turned = firsts[1] == firsts[2] or firsts[3] == firsts[0]
    elif max(pairs) < _LONG * min(pairs):
        means = [away[vertices].mean() for vertices, _ in runs]
        is_turned = abs(means[1] - means[3]) > abs(means[0] - means[2])
    return runs[1:] + runs[:1] if is_turned else runs


def _filled(topology, places):
    """Return places (v, 2) with inner vertices at the mean of their neighbors."""
    is_inner = np.ones(topology.vertex_count, bool)
    is_inner[topology.loops[0]] = False
    return _relaxed(topology.edges, is_inner, places) if is_inner.any() else places


def _relaxed(edges, is_inner, places):
    """Solve for the mean of neighbors at inner vertices, by conjugate gradients [Hestenes52]."""
    count = len(places)
    ends = np.concatenate([edges, edges[:, ::-1]])
    degrees = np.bincount(ends[:, 0], minlength=count)[:, None].astype(np.float64)

    def differences(values):
        sums = [np.bincount(ends[:, 0], weights=values[ends[:, 1], axis], minlength=count) for axis in range(2)]
        return np.where(is_inner[:, None], degrees * values - np.stack(sums, axis=1), 0.0)

    is_small = np.count_nonzero(is_inner) <= _SMALL
    found = np.where(is_inner[:, None], 0.5 if is_small else _places_between(ends, is_inner, places), places)
    rest = -differences(found)
    direction, square = rest.copy(), (rest**2).sum(axis=0)
    limit = (_EXACT if is_small else _CLOSE) * np.maximum(square, 1.0)
    for _step in range(4 * int(np.count_nonzero(is_inner)) + 10):
        if (square <= limit).all():
            break
        changed = differences(direction)
        step = square / np.maximum((direction * changed).sum(axis=0), 1e-300)
        found += step * direction
        rest -= step * changed
        before, square = square, (rest**2).sum(axis=0)
        direction = rest + square / np.maximum(before, 1e-300) * direction
    return found


def _places_between(ends, is_inner, places):
    """Return places (v, 2) by the number of edges to opposite sides: exact on a grid, and a start for the solution."""
    order = np.argsort(ends[:, 0], kind="stable")
    others = ends[order, 1]
    starts = np.searchsorted(ends[order, 0], np.arange(len(places) + 1))
    found = np.full(places.shape, 0.5)
    for axis in range(2):
        low, high = (_steps_from(~is_inner & (places[:, axis] == side), starts, others) for side in (0.0, 1.0))
        is_between = np.isfinite(low) & np.isfinite(high)
        found[is_between, axis] = low[is_between] / (low + high)[is_between]
    return found


def _steps_from(is_source, starts, others):
    """Return the number of edges (v,) from each vertex to the nearest source, inf for none.

    starts (v + 1,), others: neighbors of all vertices in turn.
    """
    steps = np.full(len(is_source), np.inf)
    front, step = np.flatnonzero(is_source), 0
    while len(front):
        steps[front] = step
        counts = starts[front + 1] - starts[front]
        rows = np.arange(counts.sum()) + np.repeat(starts[front] - np.cumsum(counts) + counts, counts)
        front = others[rows]
        front, step = np.unique(front[np.isinf(steps[front])]), step + 1
    return steps
