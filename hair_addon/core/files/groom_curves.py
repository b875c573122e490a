# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and strands for export to other programs: attributes, points in parts, and limits of importers."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import HairError
from ..geometry import strands
from ..shading.appearance import Appearance

AT_ONCE = 16_384  # curves in a part: temporary arrays of all curves would multiply the memory

GUIDE_SLOTS = 3  # guides of a strand in Unreal's interpolation

# Limits of Unreal, which warns when it drops further points of a strand.
MOST_POINTS_OF_CURVE = 255
MOST_POINTS_OF_GROUP = 2**24 - 1
MOST_CURVES_OF_GROUP = 2**22 - 1

# Function of a slice of curves → concatenated values at their points.
Rows = Callable[[slice], np.ndarray]


@dataclass(frozen=True)
class GroomCurves:
    """Attributes of guides or strands, without their points.

    counts: (S,) int32 numbers of points; first_id: ID of the first curve, IDs are consecutive; widths: diameters
    (N,), in the unit of points; root_uvs: (S, 2), None without a UV map; guide_ids and guide_weights: (S, 3) from
    `closest_guides`, None for guides; colors: linear RGB (N, 3), and roughness (N,), None if not exported;
    radial_roughness: (S,), None unless exported and varied by a map; look: of strands.
    """

    group_id: int
    group_name: str
    is_guide: bool
    counts: np.ndarray
    first_id: int
    widths: Rows
    root_uvs: np.ndarray | None = None
    guide_ids: np.ndarray | None = None
    guide_weights: np.ndarray | None = None
    colors: Rows | None = None
    roughness: Rows | None = None
    radial_roughness: np.ndarray | None = None
    look: Appearance | None = None

    @property
    def name(self) -> str:
        """Name of the object in a file."""
        return guides_name(self.group_name) if self.is_guide else self.group_name

    @property
    def curve_count(self) -> int:
        """Number of curves S."""
        return len(self.counts)

    @property
    def ids(self) -> np.ndarray:
        """IDs (S,) int32."""
        return np.arange(self.first_id, self.first_id + self.curve_count, dtype=np.int32)


def slices(count: int) -> Iterator[slice]:
    """Yield slices of at most `AT_ONCE` curves."""
    return (slice(start, min(start + AT_ONCE, count)) for start in range(0, count, AT_ONCE))


def closest_guides(indices: np.ndarray, weights: np.ndarray, first_id: int) -> tuple[np.ndarray, np.ndarray]:
    """Return each strand's three guides of largest weight: IDs (S, 3) int32, and weights (S, 3) float32 with sum 1.

    indices and weights: (S, k) of guides, -1 for none; first_id: ID of guide 0. A strand with fewer than three guides
    repeats its first one with weight 0; a strand without guides has zero weights.
    """
    ids = np.empty((len(indices), GUIDE_SLOTS), np.int32)
    shares = np.empty((len(indices), GUIDE_SLOTS), np.float32)
    for some in slices(len(indices)):
        ids[some], shares[some] = _closest(indices[some], weights[some])
    return ids + np.int32(first_id), shares


def _closest(indices, weights):
    """Return `closest_guides` of some strands, with indices of guides instead of IDs."""
    kept_weights = np.where(indices >= 0, np.maximum(weights, 0.0), 0.0).astype(np.float64)
    order = np.argsort(-kept_weights, axis=1, kind="stable")[:, :GUIDE_SLOTS]
    ids, shares = np.zeros((len(indices), GUIDE_SLOTS), np.int32), np.zeros((len(indices), GUIDE_SLOTS))
    slot_count = order.shape[1]
    ids[:, :slot_count] = np.take_along_axis(indices, order, axis=1)
    shares[:, :slot_count] = np.take_along_axis(kept_weights, order, axis=1)
    ids = np.where(shares > 0.0, ids, np.maximum(ids[:, :1], 0))
    total = shares.sum(axis=1, keepdims=True)
    return ids, shares / np.where(total > 0.0, total, 1.0)


@dataclass
class Check:
    """Checks of a group's points while they are written."""

    curves: GroomCurves
    no_length: set[int] = field(default_factory=set)

    def parts(self, points: Rows) -> Iterator[np.ndarray]:
        """Yield the points (N, 3) float32 of all curves in parts. Raises `HairError` at non-finite coordinates."""
        for chosen in slices(self.curves.curve_count):
            part = np.asarray(points(chosen), np.float32)
            # One pass: a finite sum implies finite coordinates; only an overflow needs the second test.
            if not np.isfinite(part.sum()) and not np.isfinite(part).all():
                raise HairError(
                    'The group "{name}" has non-finite coordinates: nothing was written.', name=self.curves.group_name
                )
            counts = self.curves.counts[chosen]
            starts = strands.curve_offsets(counts)[:-1]
            is_off_root = part != np.repeat(part[starts], counts, axis=0)
            is_long = np.logical_or.reduceat(is_off_root.ravel(), 3 * starts)
            self.no_length.update((chosen.start + np.flatnonzero(~is_long)).tolist())
            yield part

    def notes(self) -> Iterator[HairError]:
        """Yield warnings about how importers treat these curves."""
        curves, name = self.curves, self.curves.group_name
        if self.no_length:
            count = len(self.no_length)
            yield HairError(
                '"{name}": {count} strands have no length: importers warn, or leave them out.', name=name, count=count
            )
        if curves.root_uvs is None:
            yield HairError(
                '"{name}" has no UV coordinates of roots: Unreal computes some. Give the surface a UV map.',
                name=name,
            )
        if curves.guide_weights is not None and not curves.guide_weights.any(axis=1).all():
            count = int((~curves.guide_weights.any(axis=1)).sum())
            yield HairError('"{name}": {count} strands follow no guide and will not move.', name=name, count=count)
        yield from limit_notes(name, curves.counts)


def limit_notes(name: str, counts: np.ndarray) -> Iterator[HairError]:
    """Yield warnings about Unreal's limits for a group's guides or strands; counts: (S,) numbers of points."""
    curve_count, point_count = len(counts), int(counts.sum(dtype=np.int64))
    most = int(counts.max(initial=0))
    if most > MOST_POINTS_OF_CURVE:
        yield HairError(
            '"{name}" has {count} points a strand: Unreal keeps the first {most}.',
            name=name,
            count=most,
            most=MOST_POINTS_OF_CURVE,
        )
    if curve_count > MOST_CURVES_OF_GROUP:
        yield HairError(
            '"{name}" has {count} strands, but Unreal holds {most} in a group: divide the hair.',
            name=name,
            count=curve_count,
            most=MOST_CURVES_OF_GROUP,
        )
    if point_count > MOST_POINTS_OF_GROUP:
        yield HairError(
            '"{name}" has {count} points, but Unreal holds {most} in a group: use fewer strands or divide the hair.',
            name=name,
            count=point_count,
            most=MOST_POINTS_OF_GROUP,
        )


def group_names(names: Sequence[str], reserved: Collection[str] = ()) -> list[str]:
    """Return unique names of groups of ASCII letters, digits and underscores, which all programs accept.

    They also differ from the `guides_name` of every group. reserved: names that no group may have.
    """
    result, taken = [], set(reserved)
    for name in names:
        base = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in name).strip("_") or "hair"
        base = f"_{base}" if base[0].isdigit() else base
        unique, number = base, 1
        while not taken.isdisjoint({unique, guides_name(unique)}):
            number += 1
            unique = f"{base}_{number}"
        result.append(unique)
        taken |= {unique, guides_name(unique)}
    return result


def guides_name(group_name: str) -> str:
    """Return the name of the object of a group's guides; the strands' object has the group's name."""
    return f"{group_name}_guides"
