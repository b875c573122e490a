# SPDX-License-Identifier: GPL-3.0-or-later
"""Unit and up axis of a file's curves: given by the user, stated in the file, or chosen by the surface."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import HairError
from ..geometry.closest_point import SurfaceQuery
from ..geometry.mesh import TriMesh, positions
from ..geometry.strands import curve_offsets
from .curve_file import TO_Z_UP, UNITS, Convention, CurveFile, CurveSet

_TRIED = 256  # number of curves that are sampled
_ON = 0.05  # largest distance of roots on the surface, as a fraction of its size or of the curves' extent

_WORDS = {
    "m": "meters",
    "cm": "centimeters",
    "mm": "millimeters",
    "in": "inches",
    "ft": "feet",
    "km": "kilometers",
}


@dataclass(frozen=True)
class Reading:
    """The chosen unit and axis, with notes for the user."""

    meters: float
    up: str
    notes: list[HairError]


def choose(file: CurveFile, sets: Sequence[CurveSet], given: Convention, mesh: TriMesh, name: str) -> Reading:
    """Return the `Reading` of sets of a file: the user's convention, the file's, or one with roots on the surface.

    given: the user's convention; mesh: the surface in world space [m]; name: of the file. Raises `HairError` if the
    distance of the roots to the surface exceeds the surface's size.
    """
    known = given.over(file.stated)
    ends = _Ends(sets, mesh)
    usual = known.over(file.usual)
    taken, notes = usual, []
    if known.meters is None or known.up is None:
        taken = next((one for one in _conventions(known, usual) if ends.lie_on_surface(one)), usual)
        sentence = "{file} does not state its unit and axis: it is read in {unit} with {up} up"
        sentence += ", which puts roots on the surface." if ends.lie_on_surface(taken) else ", the most common ones."
        notes.append(HairError(sentence, file=name, unit=_named(taken.meters), up=taken.up))
    assert taken.meters is not None and taken.up is not None
    if not ends.lie_on_surface(taken):
        notes += ends.complaints(taken, name)
    return Reading(taken.meters, taken.up, notes)


def _conventions(known, usual) -> Iterator[Convention]:
    """Yield the possible conventions, the most common first."""
    units = [usual.meters, *UNITS.values()] if known.meters is None else [known.meters]
    axes = [usual.up, "Z", "Y", "X"] if known.up is None else [known.up]
    for meters, up in itertools.product(dict.fromkeys(units), dict.fromkeys(axes)):
        yield Convention(meters, up)


def _named(meters):
    """Return a unit in words."""
    return next((_WORDS[name] for name, one in UNITS.items() if one == meters), f"units of {meters:g} m")


class _Ends:
    """Ends of some curves in file coordinates, and the distance of the ends to the surface for a convention."""

    def __init__(self, sets, mesh):
        found = []
        for one in sets:
            if len(one):
                chosen = np.unique(np.linspace(0, len(one) - 1, _TRIED // len(sets) + 2).astype(np.int64))
                starts = curve_offsets(one.counts)
                found.append(np.stack([one.points[starts[:-1][chosen]], one.points[starts[1:][chosen] - 1]], axis=1))
        ends = np.concatenate(found) if found else np.zeros((0, 2, 3))
        self._ends = ends[np.isfinite(ends).all(axis=(1, 2))].astype(np.float64)
        self._query, self._mesh = SurfaceQuery(mesh), mesh
        self._low, self._high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        self._size = float((self._high - self._low).max())

    def lie_on_surface(self, convention):
        """Return whether roots lie on the surface; False if the curves are too small to tell."""
        distance, extent = self._measured(convention)
        return distance <= _ON * min(self._size, extent)

    def complaints(self, taken, name) -> Iterator[HairError]:
        """Yield warnings for roots off the surface. Raises `HairError` if their distance exceeds the surface's size."""
        others = [*_conventions(Convention(), taken)]
        distances = [self._measured(other)[0] if self.lie_on_surface(other) else np.inf for other in others]
        best = int(np.argmin(distances))
        distance = self._measured(taken)[0]
        values = {"file": name, "distance": distance, "size": self._size}
        values |= {"unit": _named(taken.meters), "up": taken.up}
        sentence = "The roots in {file} lie {distance:.3g} m from the surface, which is {size:.3g} m large, "
        sentence += "in {unit} with {up} up"
        if np.isfinite(distances[best]):
            sentence += ": they would lie on it in {other} with {other_up} up."
            values |= {"other": _named(others[best].meters), "other_up": others[best].up}
        elif distance > self._size:
            sentence += ": check the unit, the axis and the surface."
        else:
            return
        error = HairError(sentence, **values)
        if distance > self._size:
            raise error
        yield error

    def _measured(self, convention):
        """Return (median distance of roots to the surface, extent of all curves) [m]; roots are the nearer ends."""
        if not len(self._ends):
            return 0.0, 0.0
        ends = self._ends @ (TO_Z_UP[convention.up] * convention.meters).T
        extent = float(np.ptp(ends.reshape(-1, 3), axis=0).max())
        outside = np.maximum(np.maximum(self._low - ends, ends - self._high), 0.0)
        distances = np.linalg.norm(outside, axis=2)  # to the bounding box: sufficient for distant ends
        near = distances < 2.0 * self._size
        places = ends[near].astype(np.float32)
        if len(places):
            found = positions(self._mesh, self._query.nearest(places))
            distances[near] = np.linalg.norm(found - places, axis=1)
        return float(np.median(distances.min(axis=1))), extent
