# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry of an [Alembic26] file's curves, as polylines or Catmull-Rom splines in object coordinates."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry.curves import bezier_segments
from ...geometry.curves.bezier_segments import each
from ...geometry.strands import curve_offsets
from .reader import Archive, Damaged, Property
from .transforms import values_at

_CUBIC, _LINEAR, _ANY_ORDER = 0, 1, 2
_BASES = {1: "bezier", 2: "bspline", 3: "catmullRom"}
_HERMITE, _POWER = 4, 5
_MOST_ORDER = 16
_MOST_POINTS = 2**26  # limit of points after subdivision of curves other than polylines

_NOT_DRAWN = '"{name}" in {path}: {count} curves have too few points, or points that belong to no segment.'
_ODD_WIDTHS = '"{name}" in {path} has widths that are neither per point nor per curve: they are left out.'
_POWERS = '"{name}" in {path} has {count} curves in the power basis, which is not supported.'


@dataclass(frozen=True)
class Drawn:
    """Points (M, 3) float64 of curves, counts (K,) of each, and diameters (M,) or None.

    kept: (S,) mask of these curves among the object's curves; lines: number of lines of each segment, None for curves
    that keep their points; notes: [(sentence, count)], warnings for the user.
    """

    points: np.ndarray
    counts: np.ndarray
    widths: np.ndarray | None
    kept: np.ndarray
    is_smooth: bool
    lines: np.ndarray | None
    notes: list[tuple[str, int]]


class Shape:
    """Curves with the properties of AbcGeom's schema. Raises `Damaged`.

    is_of_blender: whether Blender wrote the curves. Blender's Catmull-Rom splines pass through all of their points, and
    Blender's Bézier curves have no handles.
    """

    def __init__(self, archive: Archive, properties: Mapping[str, Property], is_of_blender: bool) -> None:
        self._archive, self._properties = archive, properties
        if "P" not in properties or "nVertices" not in properties:
            raise Damaged
        self.points = properties["P"]
        self.keeps_counts = len(properties["nVertices"].addresses) < 2
        self._counts = _numbers(archive, properties["nVertices"], "iu").astype(np.int64)
        kind, wrap, basis = _LINEAR, 0, 0
        if "curveBasisAndType" in properties:
            (found,) = _numbers(archive, properties["curveBasisAndType"], "iu").reshape(-1, 4)[:1].tolist() or [[1] * 4]
            kind, wrap, basis = found[:3]
        self._is_closed, self._is_smooth = wrap == 1, is_of_blender and basis == 3 and kind != _ANY_ORDER
        if self._is_smooth or (is_of_blender and basis == 1):
            kind = _LINEAR
        self._kind, self._basis = kind, basis
        self._first = _points(archive.values(self.points))
        if self._counts.min(initial=0) < 0 or self._counts.sum() != len(self._first):
            raise Damaged
        self._orders, self._knots, self._weights = self._of_nurbs()
        self._kept = self._are_valid()
        self._set_trim()

    def drawn(self) -> Drawn:
        """Return the curves at the file's first sample."""
        counts, kept, notes = self._counts, self._kept, []
        if self._basis == _POWER and self._kind == _CUBIC:
            notes.append((_POWERS, len(counts)))
        elif not kept.all():
            notes.append((_NOT_DRAWN, int((~kept).sum())))
        widths = self._widths(notes)
        values = self._first
        if widths is not None and len(widths) == len(values):
            values = np.column_stack([values, widths])
        values, new_counts, places, lines = self._divided(values, None)
        if values.shape[1] > 3:
            widths = values[:, 3]
        elif widths is not None and len(widths) in (1, len(counts)):
            widths = np.repeat(np.broadcast_to(widths, len(counts))[kept], new_counts)
        elif widths is not None and places is not None:
            widths = np.interp(places, np.arange(len(widths)), widths)
        return Drawn(values[:, :3], new_counts, widths, kept, self._is_smooth, lines, notes)

    def points_at(self, archive: Archive, time: float, drawn: Drawn) -> np.ndarray:
        """Return the points (M, 3) at a time [s]; archive: the open archive; drawn: the result of `drawn`."""
        points = _points(values_at(archive, self.points, time))
        if len(points) != len(self._first):
            raise Damaged
        return self._divided(points, drawn.lines)[0]

    def _of_nurbs(self):
        """Return (orders (S,), knots, weights (N,) or None) of NURBS; knots are None for other curves."""
        counts = self._counts
        weights = self._optional("w", "f", len(self._first))
        if weights is not None and not (np.isfinite(weights).all() and (weights > 0.0).all()):
            raise Damaged
        orders = self._optional(".orders", "iu", len(counts))
        orders = np.full(len(counts), 4) if orders is None else orders.astype(np.int64)
        if self._kind not in (_CUBIC, _ANY_ORDER) or orders.min(initial=2) < 2 or orders.max(initial=2) > _MOST_ORDER:
            return orders, None, None
        knots = self._optional(".knots", "f", int((counts + orders).sum()))
        if self._kind == _CUBIC and (knots is None or self._basis not in (0, 2)):
            return orders, None, None
        if knots is None:
            _own, knots = each(counts + orders)  # uniform
        knots = knots.astype(np.float64)
        is_last = np.zeros(len(knots), bool)
        is_last[curve_offsets(counts + orders)[1:] - 1] = True
        if not (np.isfinite(knots).all() and ((np.diff(knots) >= 0.0) | is_last[:-1]).all()):
            raise Damaged
        return orders, knots, weights

    def _optional(self, name, kind, count):
        """Return a property's values if they have this kind and count, else None."""
        if name not in self._properties:
            return None
        values = parameter(self._archive, self._properties[name])
        is_fitting = not isinstance(values, list) and values.shape == (count,) and values.dtype.kind in kind
        return values if is_fitting else None

    def _are_valid(self):
        """Return (S,) bool: whether each curve has enough points."""
        counts = self._counts
        if self._knots is not None:
            return counts >= self._orders
        if self._kind != _CUBIC:
            return counts >= 2
        if self._basis == _POWER:
            return np.zeros(len(counts), bool)
        if self._basis == _HERMITE:
            return (counts >= 4) & (counts % 2 == 0)
        return bezier_segments.is_cubic(counts, self._name, self._wrap)

    @property
    def _name(self):
        return _BASES.get(self._basis, "bspline")

    @property
    def _wrap(self):
        return "periodic" if self._is_closed else "nonperiodic"

    def _set_trim(self):
        """Drop the duplicated end points of Catmull-Rom splines: Blender itself counts end points twice."""
        self._trim = 0
        if self._kind != _CUBIC or self._basis != 3 or self._is_closed or self._knots is not None:
            return
        first = curve_offsets(self._counts)[:-1][self._kept]
        last, points = first + self._counts[self._kept] - 1, self._first
        if (points[first] == points[first + 1]).all() and (points[last] == points[last - 1]).all():
            self._trim, self._is_smooth, self._kind = 1, True, _LINEAR

    def _divided(self, values, lines):
        """Return (values (M, D), counts (K,), places (M,) or None, lines or None) of the kept curves."""
        counts, kept = self._counts, self._kept
        rows = np.flatnonzero(np.repeat(kept, counts))
        if self._knots is not None:
            segments = bezier_segments.nurbs(
                values[rows],
                None if self._weights is None else self._weights[rows],
                counts[kept],
                self._orders[kept],
                self._knots[np.repeat(kept, counts + self._orders)],
                None,
            )
        elif self._kind != _CUBIC:
            closes = self._is_closed and not self._trim
            if kept.all() and not closes and not self._trim:
                return values, counts, None, None
            starts, made = curve_offsets(counts)[:-1][kept] + self._trim, counts[kept] - 2 * self._trim
            own, along = each(made + closes)
            return values[starts[own] + along % made[own]], made + closes, None, None
        elif self._basis == _HERMITE:
            held = values[rows]
            segments = bezier_segments.hermite(held[::2], held[1::2], counts[kept] // 2)
        else:
            segments = bezier_segments.cubic(values[rows], counts[kept], self._name, self._wrap)
        if lines is None:
            most = max(_MOST_POINTS // max(len(segments.controls), 1), 1)
            lines = np.minimum(bezier_segments.line_counts(segments), most)
        made, made_counts, places = bezier_segments.polylines(segments, lines)
        return made, made_counts, places, lines

    def _widths(self, notes):
        """Return diameters: for each point, each curve, all curves or each end of a segment; None without widths."""
        counts, found = self._counts, None
        for place, name in (("", "width"), (".arbGeomParams", "groom_width")):
            properties = self._properties[place].children if place in self._properties else self._properties
            if found is None and name in properties:
                found = parameter(self._archive, properties[name])
        if found is None or isinstance(found, list) or not len(found):
            return None
        widths = found.astype(np.float64)
        ends = -1
        if self._kind == _CUBIC and self._knots is None and self._kept.all() and self._basis in _BASES:
            segments = bezier_segments.segment_counts(counts, self._name, self._wrap)
            ends = int((segments + 1).sum())
        if widths.ndim != 1 or len(widths) not in (len(self._first), len(counts), 1, ends):
            notes.append((_ODD_WIDTHS, len(counts)))
            return None
        return widths


def parameter(archive: Archive, target: Property) -> Any:
    """Return the first sample of a geometry parameter, indexed or not: (n,) or (n, extent) values, or a list of str."""
    if ".vals" not in target.children:
        return archive.values(target) if target.addresses else np.zeros(0)
    values = archive.values(target.children[".vals"])
    if ".indices" not in target.children:
        return values
    indices = _numbers(archive, target.children[".indices"], "iu").astype(np.int64)
    if len(indices) and not 0 <= indices.min() <= indices.max() < len(values):
        raise Damaged
    return [values[index] for index in indices] if isinstance(values, list) else values[indices]


def _numbers(archive, target, kind):
    values = archive.values(target)
    if isinstance(values, list) or values.dtype.kind not in kind:
        raise Damaged
    return values


def _points(values):
    if isinstance(values, list) or values.ndim != 2 or values.shape[1] != 3 or values.dtype.kind != "f":
        raise Damaged
    return values.astype(np.float64)
