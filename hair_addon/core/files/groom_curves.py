# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and strands as other programs take them: what each has, in parts, and what an importer makes of it."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import HairError
from ..geometry import strands
from ..shading.appearance import Appearance

AT_ONCE = 16_384  # curves in a part: arrays of all of them would take several times their memory

GUIDE_SLOTS = 3  # guides of a strand that Unreal interpolates between

# What Unreal holds; it says itself that it leaves out further points of a strand.
MOST_POINTS_OF_CURVE = 255
MOST_POINTS_OF_GROUP = 2**24 - 1
MOST_CURVES_OF_GROUP = 2**22 - 1

# Values at the points of some curves, one curve after another: those of a slice of all.
Rows = Callable[[slice], np.ndarray]


@dataclass(frozen=True)
class GroomCurves:
    """All of some guides or strands but where they are.

    counts: (S,) int32 points of each curve; first_id: identity of the first, the others' follow; widths: diameters
    (N,), in the units of points; root_uvs: (S, 2), None without a UV map; guide_ids and guide_weights: (S, 3) as
    `closest_guides` gives them, None of guides; colors: linear RGB (N, 3), and roughness (N,), None if they are not
    exported; look: of strands.
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
    look: Appearance | None = None

    @property
    def name(self) -> str:
        """The name of their object in a file."""
        return guides_name(self.group_name) if self.is_guide else self.group_name

    @property
    def curve_count(self) -> int:
        """S."""
        return len(self.counts)

    @property
    def ids(self) -> np.ndarray:
        """(S,) int32."""
        return np.arange(self.first_id, self.first_id + self.curve_count, dtype=np.int32)


def slices(count: int) -> Iterator[slice]:
    """The parts of so many curves."""
    return (slice(start, min(start + AT_ONCE, count)) for start in range(0, count, AT_ONCE))


def closest_guides(indices: np.ndarray, weights: np.ndarray, first_id: int) -> tuple[np.ndarray, np.ndarray]:
    """Return identities (S, 3) int32 and weights (S, 3) float32, which sum to 1, of the guides that weigh most.

    indices and weights: (S, k) of guides, -1 for none; first_id: identity of guide 0. Where a strand has fewer than
    three, its first is repeated with weight 0; one without guides has weights of 0.
    """
    ids = np.empty((len(indices), GUIDE_SLOTS), np.int32)
    shares = np.empty((len(indices), GUIDE_SLOTS), np.float32)
    for some in slices(len(indices)):
        ids[some], shares[some] = _closest(indices[some], weights[some])
    return ids + np.int32(first_id), shares


def _closest(indices, weights):
    """The same of some strands, as indices of guides."""
    kept_weights = np.where(indices >= 0, np.maximum(weights, 0.0), 0.0).astype(np.float64)
    order = np.argsort(-kept_weights, axis=1, kind="stable")[:, :GUIDE_SLOTS]
    ids, shares = np.zeros((len(indices), GUIDE_SLOTS), np.int32), np.zeros((len(indices), GUIDE_SLOTS))
    kept = order.shape[1]
    ids[:, :kept] = np.take_along_axis(indices, order, axis=1)
    shares[:, :kept] = np.take_along_axis(kept_weights, order, axis=1)
    ids = np.where(shares > 0.0, ids, np.maximum(ids[:, :1], 0))
    total = shares.sum(axis=1, keepdims=True)
    return ids, shares / np.where(total > 0.0, total, 1.0)


@dataclass
class Check:
    """What was found in the points of a group's guides or strands while they were written."""

    curves: GroomCurves
    no_length: set[int] = field(default_factory=set)

    def parts(self, points: Rows) -> Iterator[np.ndarray]:
        """Points (N, 3) float32 of all curves, part after part. Raises `HairError` at non-finite coordinates."""
        for chosen in slices(self.curves.curve_count):
            part = np.asarray(points(chosen), np.float32)
            # The sum is finite exactly where all are, but for an overflow, and reads the points only once.
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
        """What an importer will do with these curves, as sentences."""
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
            yield HairError('"{name}": {count} strands follow no guide, and none moves them.', name=name, count=count)
        yield from limit_notes(name, curves.counts)


def limit_notes(name: str, counts: np.ndarray) -> Iterator[HairError]:
    """What Unreal will not hold of a group's guides or strands, which have (S,) points each."""
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
    """Return names of groups that differ, of letters, digits and underscores, as all programs take them.

    With `guides_name` no two objects of a file are called the same. reserved: names that no group has.
    """
    made, taken = [], set(reserved)
    for name in names:
        kept = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in name).strip("_") or "hair"
        kept = f"_{kept}" if kept[0].isdigit() else kept
        unique, number = kept, 1
        while not taken.isdisjoint({unique, guides_name(unique)}):
            number += 1
            unique = f"{kept}_{number}"
        made.append(unique)
        taken |= {unique, guides_name(unique)}
    return made


def guides_name(group_name: str) -> str:
    """The name of the object of a group's guides; that of its strands is the group's."""
    return f"{group_name}_guides"
