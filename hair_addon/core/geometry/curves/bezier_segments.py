# SPDX-License-Identifier: GPL-3.0-or-later
"""Cubic curves of [UsdCurves24] and NURBS as rational Bézier segments, and Bézier segments as polylines.

A curve's values are rows of numbers: the position, and further attributes that are interpolated like the position,
such as a width.
"""

from dataclasses import dataclass

import numpy as np

from .. import strands

# Accuracy of polylines: 40 µm for a strand of 20 cm, half a hair's thickness. The relative error of the length is at
# most the angle squared / 24, or 0.1 %.
SAGITTA = 2e-4  # largest distance from the curve, as a fraction of its length
TURN = 0.15  # largest angle between neighboring lines [rad]

_MOST_LINES = 128  # of a segment
_AT_ONCE = 2048  # segments in a batch, which fits caches

# Rows: Bézier controls; columns: the segment's four controls in the basis.
BASES = {
    "bezier": np.eye(4),
    "bspline": np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6.0,
    "catmullRom": np.array([[0, 6, 0, 0], [-1, 6, 1, 0], [0, 1, 6, -1], [0, 0, 6, 0]]) / 6.0,
}
STEPS = {"bezier": 3, "bspline": 1, "catmullRom": 1}


@dataclass(frozen=True)
class Segments:
    """Bézier segments, concatenated over the curves.

    controls: (K, p + 1, D) float64; weights: (K, p + 1), positive, None for polynomials; counts: (S,) segments of each
    curve; places: (K, 2) indices, with fractions, of a segment's start and end among attribute values that are linear
    between the ends of segments; a curve of n segments has n + 1 of these values.
    """

    controls: np.ndarray
    counts: np.ndarray
    places: np.ndarray
    weights: np.ndarray | None = None


def cubic(values: np.ndarray, counts: np.ndarray, basis: str, wrap: str) -> Segments:
    """Return the `Segments` of cubic curves of a basis; values: (N, D), counts: (S,) rows of each curve.

    wrap: "nonperiodic", "periodic", or "pinned", where B-splines and Catmull-Rom splines begin and end at their first
    and last points. All curves must be `is_cubic`.
    """
    values, counts = np.asarray(values, np.float64), np.asarray(counts, np.int64)
    if wrap == "pinned" and basis != "bezier":
        values, counts = _pinned(values, counts)
        wrap = "nonperiodic"
    step = STEPS[basis]
    segments = segment_counts(counts, basis, wrap)
    own, along = each(segments)
    within = along[:, None] * step + np.arange(4)
    if wrap == "periodic":
        within %= counts[own][:, None]
    rows = strands.curve_offsets(counts)[own][:, None] + within
    controls = np.zeros((len(rows), 4, values.shape[1]))
    for near, shares in enumerate(BASES[basis].T):
        column = values[rows[:, near]]
        for control in np.flatnonzero(shares):
            controls[:, control] += shares[control] * column
    return Segments(controls, segments, _places(segments, own, along))


def segment_counts(counts: np.ndarray, basis: str, wrap: str) -> np.ndarray:
    """Return the number of segments (S,) of cubic curves with counts (S,) of points; arbitrary unless `is_cubic`."""
    counts = np.asarray(counts)
    if wrap == "periodic":
        return counts // STEPS[basis]
    if wrap == "pinned" and basis != "bezier":
        return counts - 1
    return (counts - 4) // STEPS[basis] + 1


def is_cubic(counts: np.ndarray, basis: str, wrap: str) -> np.ndarray:
    """Return (S,) bool: whether counts (S,) are valid for cubic curves: with segments and without unused points."""
    counts = np.asarray(counts)
    if wrap == "periodic":
        return (counts >= 3) & (counts % STEPS[basis] == 0)
    if wrap == "pinned" and basis != "bezier":
        return counts >= 2
    return (counts >= 4) & ((counts - 4) % STEPS[basis] == 0)


def _pinned(values, counts):
    """Return values and counts of pinned curves with a phantom point added at each end."""
    starts = strands.curve_offsets(counts)
    first, last = starts[:-1], starts[1:] - 1
    out = np.empty((len(values) + 2 * len(counts), values.shape[1]))
    own = np.repeat(np.arange(len(counts)), counts)
    out[np.arange(len(values)) + 2 * own + 1] = values
    at = first + 2 * np.arange(len(counts))
    out[at] = 2.0 * values[first] - values[first + 1]
    out[at + counts + 1] = 2.0 * values[last] - values[last - 1]
    return out, counts + 2


def hermite(values: np.ndarray, tangents: np.ndarray, counts: np.ndarray) -> Segments:
    """Return the `Segments` of cubic Hermite curves; values and tangents: (N, D), counts: (S,) rows of each curve."""
    values, tangents, counts = np.asarray(values, np.float64), np.asarray(tangents, np.float64), np.asarray(counts)
    segments = np.maximum(counts - 1, 0)
    own, along = each(segments)
    start = strands.curve_offsets(counts)[own] + along
    end = start + 1
    inner = values[start] + tangents[start] / 3.0, values[end] - tangents[end] / 3.0
    controls = np.stack([values[start], *inner, values[end]], axis=1)
    return Segments(controls, segments, _places(segments, own, along))


def nurbs(
    values: np.ndarray,
    weights: np.ndarray | None,
    counts: np.ndarray,
    orders: np.ndarray,
    knots: np.ndarray,
    ranges: np.ndarray | None,
) -> Segments:
    """Return the `Segments` of NURBS; values: (N, D) and weights (N,), counts: (S,) rows of each curve, orders: (S,).

    knots: (N + sum of orders,), non-decreasing; ranges: (S, 2) parameters of the curves' ends, None for whole curves.
    """
    values, counts, orders = np.asarray(values, np.float64), np.asarray(counts, np.int64), np.asarray(orders, np.int64)
    is_rational = weights is not None
    if is_rational:
        weights = np.asarray(weights, np.float64)[:, None]
        values = np.hstack([values * weights, weights])
    starts, knot_starts = strands.curve_offsets(counts), strands.curve_offsets(counts + orders)
    knots = np.asarray(knots, np.float64)
    low, high = knots[knot_starts[:-1] + orders - 1], knots[knot_starts[:-1] + counts]
    if ranges is not None:
        low, high = np.maximum(low, ranges[:, 0]), np.minimum(high, ranges[:, 1])
    span_counts = counts - orders + 1
    value_starts = strands.curve_offsets(span_counts + 1)
    degree = int(orders.max(initial=2)) - 1
    # Curve, span along it, controls, places; empty arrays first, as all curves may have too few points.
    none = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, degree + 1, values.shape[1])), np.zeros((0, 2))
    groups = [[empty] for empty in none]
    for order in np.unique(orders):
        its = np.flatnonzero(orders == order)
        own, along = each(span_counts[its])
        own = its[own]
        knot = knot_starts[own] + along + order - 1
        begin, end = np.maximum(knots[knot], low[own]), np.minimum(knots[knot + 1], high[own])
        is_there = begin < end
        own, along, knot, begin, end = (a[is_there] for a in (own, along, knot, begin, end))
        near_knots = knots[knot[:, None] + np.arange(2 - order, order)]
        near_values = values[(starts[own] + along)[:, None] + np.arange(order)]
        controls = _blossom(near_values, near_knots, begin, end)
        part = (np.stack([begin, end], 1) - knots[knot][:, None]) / (knots[knot + 1] - knots[knot])[:, None]
        for group, array in zip(
            groups, (own, along, _raised(controls, degree), (value_starts[own] + along)[:, None] + part), strict=True
        ):
            group.append(array)
    own, along, controls, places = (np.concatenate(group) for group in groups)
    sorted_rows = np.lexsort((along, own))
    controls, places = controls[sorted_rows], places[sorted_rows]
    segments = np.bincount(own.astype(np.intp), minlength=len(counts))
    if not is_rational:
        return Segments(controls, segments, places)
    return Segments(controls[..., :-1] / controls[..., -1:], segments, places, controls[..., -1])


def _blossom(values, knots, begin, end):
    """Return the Bézier controls (K, p + 1, D) of spans, by blossoming; values: (K, p + 1, D), knots: (K, 2 p)."""
    degree = values.shape[1] - 1
    controls = np.empty_like(values)
    for control in range(degree + 1):
        level = values
        for step in range(1, degree + 1):
            at = end if step <= control else begin
            left, right = knots[:, step - 1 : degree], knots[:, degree : 2 * degree - step + 1]
            part = ((at[:, None] - left) / (right - left))[..., None]
            level = (1.0 - part) * level[:, :-1] + part * level[:, 1:]
        controls[:, control] = level[:, 0]
    return controls


def _raised(controls, degree):
    """Return the controls of the same segments after degree elevation."""
    while controls.shape[1] <= degree:
        higher = controls.shape[1]
        part = (np.arange(1, higher) / higher)[:, None]
        inner = part * controls[:, :-1] + (1.0 - part) * controls[:, 1:]
        controls = np.concatenate([controls[:, :1], inner, controls[:, -1:]], axis=1)
    return controls


def each(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (own, along) of the items of ragged rows with counts (S,): each item's row, and its index in the row."""
    own = np.repeat(np.arange(len(counts)), counts)
    return own, np.arange(len(own)) - strands.curve_offsets(counts)[:-1][own]


def _places(segments, own, along):
    start = strands.curve_offsets(segments + 1)[own] + along
    return np.stack([start, start + 1], axis=1).astype(np.float64)


def polylines(segments: Segments, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return segments as polylines: (values (M, D), counts (S,), places (M,)); places: see `Segments`.

    All points are on the curves, including their end points. lines: (K,) number of lines of each segment, as from
    `line_counts`.
    """
    owners = np.repeat(np.arange(len(segments.counts)), segments.counts)
    has_any = segments.counts > 0
    counts = np.bincount(owners, lines, len(segments.counts)).astype(np.int64) + has_any
    controls = segments.controls
    if segments.weights is not None:
        controls = np.concatenate([controls * segments.weights[..., None], segments.weights[..., None]], axis=2)
    values, places = np.empty((int(counts.sum()), controls.shape[2])), np.empty(int(counts.sum()))
    firsts = strands.curve_offsets(segments.counts)[:-1][has_any]
    at = strands.curve_offsets(counts)[:-1][has_any]
    values[at], places[at] = controls[firsts, 0], segments.places[firsts, 0]
    # A segment's rows follow all earlier lines and the first points of its own and all earlier curves.
    after = strands.curve_offsets(lines)[:-1] + np.cumsum(has_any)[owners]
    in_order = np.argsort(lines, kind="stable")
    numbers, begins = np.unique(lines[in_order], return_index=True)
    for number, alike in zip(numbers, np.split(in_order, begins)[1:], strict=True):
        parts = np.arange(1, number + 1) / number
        for first in range(0, len(alike), _AT_ONCE):
            some = alike[first : first + _AT_ONCE]
            rows = after[some] + np.arange(number)[:, None]
            values[rows] = _at(controls[some], parts)
            begin, end = segments.places[some].T
            places[rows] = begin + parts[:, None] * (end - begin)
    if segments.weights is not None:
        values = values[:, :-1] / values[:, -1:]
    return values, counts, places


def smooth_lines(
    values: np.ndarray, counts: np.ndarray, is_smooth: np.ndarray, lines: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return curves with their Catmull-Rom splines as polylines: (values (M, D), counts (S,), lines (K,)).

    values: (N, D), counts: (S,) rows of each curve; is_smooth: (S,) bool, for splines, whose end points count twice as
    in Blender; lines: number of lines of each segment of the splines, None for `line_counts`.
    """
    values, counts = np.asarray(values), np.asarray(counts, np.int64)
    is_divided = np.asarray(is_smooth) & (counts > 1)
    starts, its = strands.curve_offsets(counts)[:-1][is_divided], counts[is_divided]
    own, along = each(its + 2)
    rows = starts[own] + np.clip(along - 1, 0, its[own] - 1)
    segments = cubic(values[rows], its + 2, "catmullRom", "nonperiodic")
    lines = line_counts(segments) if lines is None else lines
    divided, divided_counts, _places = polylines(segments, lines)
    all_counts = counts.copy()
    all_counts[is_divided] = divided_counts
    is_new = np.repeat(is_divided, all_counts)
    out = np.empty((len(is_new), values.shape[1]), values.dtype)
    out[is_new], out[~is_new] = divided, values[~np.repeat(is_divided, counts)]
    return out, all_counts, lines


def _at(controls, parts):
    """Return polynomial values (T, K, D) of segments (K, p + 1, D) at parameters (T,) in [0, 1]."""
    degree, total, binomial = controls.shape[1] - 1, 0.0, 1.0
    for control in range(degree + 1):
        # Sums in a fixed order, unlike a matrix product, are bit-identical on every processor.
        basis = binomial * parts**control * (1.0 - parts) ** (degree - control)
        total = total + basis[:, None, None] * controls[:, control]
        binomial *= (degree - control) / (control + 1)
    return total


def line_counts(segments: Segments) -> np.ndarray:
    """Return the number of lines (K,) int64, uniform in parameter, for each segment by `SAGITTA` and `TURN`."""
    points = segments.controls[..., :3]
    degree = points.shape[1] - 1
    legs = np.diff(points, axis=1)
    lengths = np.linalg.norm(legs, axis=2).sum(axis=1)
    if degree < 2:
        return np.ones(len(points), np.int64)
    owners = np.repeat(np.arange(len(segments.counts)), segments.counts)
    whole = np.bincount(owners, lengths, len(segments.counts))[owners]
    bend = degree * (degree - 1) * np.linalg.norm(np.diff(legs, axis=1), axis=2).max(axis=1)  # bounds |C''|
    if segments.weights is not None:
        bend = bend * (segments.weights.max(axis=1) / segments.weights.min(axis=1)) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        by_distance = np.sqrt(bend / (8.0 * SAGITTA * whole))
        by_angle = bend / (TURN * lengths)
        # Segments that are straight within rounding become one line.
        wanted = np.where(bend > 1e-9 * whole, np.ceil(np.maximum(by_distance, by_angle)), 1.0)
    return np.clip(np.nan_to_num(wanted, nan=1.0), 1, _MOST_LINES).astype(np.int64)
