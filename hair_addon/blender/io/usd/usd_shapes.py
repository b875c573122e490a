# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape of a USD curves prim at a time: polylines or Catmull-Rom splines in local coordinates."""

from dataclasses import dataclass, replace

import numpy as np

from ....core.errors import HairError
from ....core.geometry.curves import bezier_segments
from ....core.geometry.curves.bezier_segments import each
from ....core.geometry.strands import curve_offsets
from . import usd_stage

_MOST_ORDER = 16  # of NURBS: programs write order 4, rarely up to 8


@dataclass(frozen=True)
class Drawn:
    """Points (N, 3) float64 of curves, their counts (S,), and diameters (N,), None without any.

    is_kept: which of the file's curves are included; is_smooth: whether they are Catmull-Rom splines; has_odd_widths:
    whether the number of the file's diameters is invalid; lines: as in `bezier_segments.polylines`, None for curves
    that keep their points; was_smooth: whether Catmull-Rom splines were converted to polylines.
    """

    points: np.ndarray
    counts: np.ndarray
    widths: np.ndarray | None
    is_kept: np.ndarray
    is_smooth: bool = False
    has_odd_widths: bool = False
    lines: np.ndarray | None = None
    was_smooth: bool = False


@dataclass(frozen=True)
class _Curves:
    """A prim's curves in the file: points (N, 3), counts (S,), and is_kept (S,), which of them are valid.

    segments: (S,) segment counts of valid curves.
    """

    points: np.ndarray
    counts: np.ndarray
    is_kept: np.ndarray
    segments: np.ndarray
    is_closed: bool = False

    @property
    def rows(self):
        """Indices of the points of valid curves."""
        return np.flatnonzero(np.repeat(self.is_kept, self.counts))

    @property
    def kept_counts(self):
        """Point counts (K,) of valid curves."""
        return self.counts[self.is_kept]


@dataclass(frozen=True)
class _Widths:
    """Diameters of valid curves: per point, or per segment end, of which a curve has one more than segments.

    is_odd: whether the number of diameters fits neither.
    """

    of_points: np.ndarray | None = None
    of_ends: np.ndarray | None = None
    is_odd: bool = False


def moving_attributes(prim):
    """Return the attributes of a prim whose samples animate its curves."""
    names = ("points", "tangents", "pointWeights", "curveVertexCounts")
    return [prim.GetAttribute(name) for name in names if prim.HasAttribute(name)]


def drawn(prim, time, lines=None, keeps_splines=True) -> Drawn:
    """Return the `Drawn` of a prim at a time. Raises `HairError`.

    lines: number of lines per segment, None to choose it by curvature; keeps_splines: whether to keep Catmull-Rom
    splines.
    """
    from pxr import UsdGeom

    points = _array(prim, "points", time, np.float64, 3)
    counts = _array(prim, "curveVertexCounts", time, np.int64)
    _require(prim, counts.min(initial=0) >= 0 and counts.sum() == len(points), "curveVertexCounts", "points")
    if prim.IsA(UsdGeom.HermiteCurves):
        return _hermite(prim, time, points, counts, lines)
    if prim.IsA(UsdGeom.NurbsCurves):
        return _nurbs(prim, time, points, counts, lines)
    kind, basis, wrap = (str(prim.GetAttribute(name).Get()) for name in ("type", "basis", "wrap"))
    if kind == "linear":
        return _linear(prim, time, points, counts, wrap == "periodic")
    if basis not in bezier_segments.BASES:
        raise HairError(f"{prim.GetPath()} has the basis {basis}, which USD does not define.")
    return _cubic(prim, time, points, counts, basis, wrap, lines, keeps_splines)


def _array(prim, name, time, kind, width=1):
    """Return values (N,) or (N, width) of an attribute, empty if it has none. Raises `HairError`."""
    values = usd_stage.values_at(prim.GetAttribute(name), time) if prim.HasAttribute(name) else np.empty(0)
    shape = (width,) if width > 1 else ()
    _require(prim, values is not None, name, "type")
    if not values.size:
        return np.empty((0, *shape), kind)
    _require(prim, values.dtype.kind in "iuf" and values.shape[1:] == shape and values.ndim, name, "type")
    return values.astype(kind)


def _require(prim, is_valid, name, other):
    """Raise `HairError` unless is_valid: the attribute `name` does not fit `other`."""
    if not is_valid:
        raise HairError(f"{prim.GetPath()} is damaged: its {name} do not fit its {other}.")


def _linear(prim, time, points, counts, is_closed):
    """Return polylines with their own points; closed ones repeat the first point."""
    curves = _Curves(points, counts, counts >= 2 + is_closed, counts - (not is_closed), is_closed)
    kept, starts = curves.kept_counts, curve_offsets(counts)[:-1][curves.is_kept]
    own, along = each(kept + is_closed)
    return _unchanged(curves, starts[own] + along % kept[own], kept + is_closed, _widths(prim, time, curves))


def _cubic(prim, time, points, counts, basis, wrap, lines, keeps_splines):
    is_closed, is_pinned = wrap == "periodic", wrap == "pinned" and basis != "bezier"
    is_kept = bezier_segments.is_cubic(counts, basis, wrap)
    curves = _Curves(points, counts, is_kept, bezier_segments.segment_counts(counts, basis, wrap), is_closed)
    widths = _widths(prim, time, curves, np.maximum(counts - 4, 0) + 2 if is_pinned else None)
    is_spline = basis == "catmullRom" and wrap == "nonperiodic" and _ends_twice(curves)
    if keeps_splines and is_spline:
        own, along = each(curves.kept_counts - 2)
        rows = curve_offsets(counts)[:-1][is_kept][own] + along + 1
        return _unchanged(curves, rows, curves.kept_counts - 2, widths, is_smooth=True)
    values = _with_widths(points[curves.rows], widths)
    divided = _divided(curves, bezier_segments.cubic(values, curves.kept_counts, basis, wrap), widths, lines)
    return replace(divided, was_smooth=is_spline)


def _hermite(prim, time, points, counts, lines):
    tangents = _array(prim, "tangents", time, np.float64, 3)
    _require(prim, len(tangents) == len(points), "tangents", "points")
    curves = _Curves(points, counts, counts >= 2, counts - 1)
    widths = _widths(prim, time, curves)
    if widths.of_points is not None:  # one for each end of a segment: USD has no tangents of widths
        widths = _Widths(of_ends=widths.of_points)
    segments = bezier_segments.hermite(points[curves.rows], tangents[curves.rows], curves.kept_counts)
    return _divided(curves, segments, widths, lines)


def _nurbs(prim, time, points, counts, lines):
    orders, knots = _array(prim, "order", time, np.int64), _array(prim, "knots", time, np.float64)
    weights, ranges = _array(prim, "pointWeights", time, np.float64), _array(prim, "ranges", time, np.float64, 2)
    orders = np.full(len(counts), orders[0]) if len(orders) == 1 else orders
    _require(prim, len(orders) == len(counts) and orders.min(initial=2) >= 2, "order", "curveVertexCounts")
    _require(prim, orders.max(initial=2) <= _MOST_ORDER, "order", "curves")
    _require(prim, len(knots) == (counts + orders).sum(), "knots", "order")
    _require(prim, np.isfinite(knots).all() and _rise(knots, counts + orders), "knots", "curves")
    _require(prim, len(weights) in (0, len(points)) and (weights > 0.0).all(), "pointWeights", "points")
    _require(prim, len(ranges) in (0, len(counts)) and np.isfinite(ranges).all(), "ranges", "curveVertexCounts")
    curves = _Curves(points, counts, counts >= orders, counts - orders + 1)
    kept, rows = curves.is_kept, curves.rows
    widths = _widths(prim, time, curves)
    segments = bezier_segments.nurbs(
        _with_widths(points[rows], widths),
        weights[rows] if len(weights) else None,
        counts[kept],
        orders[kept],
        knots[np.repeat(kept, counts + orders)],
        ranges[kept] if len(ranges) else None,
    )
    return _divided(curves, segments, widths, lines)


def _rise(knots, counts):
    """Whether the knots of each curve ascend."""
    is_last = np.zeros(len(knots), bool)
    is_last[curve_offsets(counts)[1:] - 1] = True
    return bool(((np.diff(knots) >= 0.0) | is_last[:-1]).all())


def _ends_twice(curves):
    """Whether the first and the last two points of each curve are the same."""
    first = curve_offsets(curves.counts)[:-1][curves.is_kept]
    last = first + curves.kept_counts - 1
    points = curves.points
    return bool((points[first] == points[first + 1]).all() and (points[last] == points[last - 1]).all())


def _unchanged(curves, rows, counts, widths, is_smooth=False):
    """Return the `Drawn` of curves that keep their points, or those at segment ends."""
    kept = np.full(len(curves.points), -1)
    kept[curves.rows] = np.arange(len(curves.rows))
    values = widths.of_ends if widths.of_points is None else widths.of_points[kept[rows]]
    return Drawn(curves.points[rows], counts, values, curves.is_kept, is_smooth, widths.is_odd)


def _with_widths(points, widths):
    return points if widths.of_points is None else np.column_stack([points, widths.of_points])


def _divided(curves, segments, widths, lines):
    """Return the `Drawn` of Bézier segments; the fourth coordinate, if any, is the diameter."""
    if lines is None or len(lines) != len(segments.controls):
        lines = bezier_segments.line_counts(segments)
    values, counts, places = bezier_segments.polylines(segments, lines)
    found = values[:, 3] if values.shape[1] > 3 else None
    if widths.of_ends is not None:
        before = np.minimum(places.astype(np.int64), len(widths.of_ends) - 2)
        part = places - before
        found = (1.0 - part) * widths.of_ends[before] + part * widths.of_ends[before + 1]
    return Drawn(values[:, :3], counts, found, curves.is_kept, False, widths.is_odd, lines)


def _widths(prim, time, curves, short_ends=None):
    """Read the `_Widths` of curves; short_ends: (S,) an alternative number of segment ends that some files use."""
    from pxr import UsdGeom

    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("widths")
    if primvar and primvar.HasValue():
        scope, values = str(primvar.GetInterpolation()), primvar.ComputeFlattened(time)
    else:
        shape = UsdGeom.Curves(prim)
        scope, values = str(shape.GetWidthsInterpolation()), shape.GetWidthsAttr().Get(time)
    values, counts, kept = usd_stage.array_of(values), curves.counts, curves.is_kept
    if values is not None and not values.size:
        return _Widths()
    if values is None or values.dtype.kind not in "iuf":
        return _Widths(is_odd=True)
    values = values.ravel().astype(np.float64)
    ends = np.maximum(curves.segments, 1) + (not curves.is_closed)
    sizes = {"constant": 1, "vertex": counts.sum(), "varying": ends.sum(), "uniform": len(counts)}
    if short_ends is not None:
        sizes["short"] = short_ends.sum()
    # Files often omit the interpolation or state a wrong one: infer it from the number of values.
    fitting = [one for one in (scope, *sizes) if sizes.get(one) == len(values)]
    if not fitting:
        return _Widths(is_odd=True)
    if fitting[0] == "vertex":
        return _Widths(of_points=values[curves.rows])
    kept_ends = curves.segments[kept] + 1
    if fitting[0] in ("constant", "uniform"):
        every = np.broadcast_to(values, len(counts)) if fitting[0] == "constant" else values
        return _Widths(of_ends=np.repeat(every[kept], kept_ends))
    # Repeat the first and last values for missing ends; closed curves end where they begin.
    there = ends if fitting[0] == "varying" else short_ends
    own, along = each(kept_ends)
    if curves.is_closed:
        along = along % there[kept][own]
    else:
        along = np.clip(along - ((kept_ends - there[kept] + 1) // 2)[own], 0, (there[kept] - 1)[own])
    return _Widths(of_ends=values[curve_offsets(there)[:-1][kept][own] + along])
