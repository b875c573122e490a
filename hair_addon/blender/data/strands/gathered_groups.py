# SPDX-License-Identifier: GPL-3.0-or-later
"""Gathered guides: attributes for the groups of guides, one for each tie or lock, and for the parts up to the tie.

The length of this part is also stored, in local units, because guides may be cut or lengthened behind their ties.
"""

from dataclasses import dataclass

import numpy as np

from ....core import geometry
from ....core.grooming.groom import POINT_COUNT
from . import attributes, curves

NAME = "gathered"
HELD = "gathered_held"
TIE = "gathered_tie"
_LENGTH = "gathered_length"  # up to the tie, in local units
_FLOAT_PER_GUIDE = "FLOAT", "CURVE"
_TYPES = ((NAME, "INT"), (HELD, "FLOAT"), (TIE, "FLOAT"), (_LENGTH, "FLOAT"))


@dataclass(frozen=True)
class Gathered:
    """groups: (G,) int32, 0 for guides that are not gathered; held: (G,) float32, the fraction of the present length up
    to the tie, or to the end of a row or bun; tie_fractions: (G,) float32, the fraction of the points up to the tie,
    after guides with other numbers of points than strands are resampled at equal spacing.
    """

    groups: np.ndarray
    held: np.ndarray
    tie_fractions: np.ndarray

    def __getitem__(self, chosen):
        return Gathered(self.groups[chosen], self.held[chosen], self.tie_fractions[chosen])


def groups_of(datablock):
    """Return the groups (G,) int32 of guides; None if no guide is gathered."""
    groups = attributes.read(datablock, NAME, "INT", "CURVE")
    return None if groups is None or not groups.any() else groups


def tie_fractions_of(datablock):
    """Return the `Gathered.tie_fractions` of guides; None if no guide is gathered."""
    groups, tie_fractions = groups_of(datablock), attributes.read(datablock, TIE, *_FLOAT_PER_GUIDE)
    if groups is None or tie_fractions is None:  # strands of files from before ties were stored do not change
        return None
    return np.where(groups != 0, np.clip(np.nan_to_num(tie_fractions), 0.0, 1.0), 0.0).astype(np.float32)


def read(datablock):
    """Return the `Gathered` of guides; None if no guide is gathered."""
    groups = groups_of(datablock)
    if groups is None:
        return None
    held = attributes.read(datablock, HELD, *_FLOAT_PER_GUIDE)
    held = np.zeros(len(groups), np.float32) if held is None else np.clip(np.nan_to_num(held), 0.0, 1.0)
    length = attributes.read(datablock, _LENGTH, *_FLOAT_PER_GUIDE)
    if length is not None:
        held = np.where(held < 1.0, np.clip(np.nan_to_num(length) / _lengths(datablock), 0.0, 1.0), held)
    tie_fractions = tie_fractions_of(datablock)
    tie_fractions = np.zeros(len(groups), np.float32) if tie_fractions is None else tie_fractions
    return Gathered(groups, np.where(groups != 0, held, 0.0).astype(np.float32), tie_fractions)


def write(datablock, gathered):
    """Store the `Gathered` of guides with their present lengths; the attributes are removed if no guide is gathered.

    gathered: None for no gathered guides.
    """
    is_any = gathered is not None and gathered.groups.any()
    for name, data_type in _TYPES:
        present = datablock.attributes.get(name)
        if present is not None and not (is_any and attributes.has(datablock, name, data_type, "CURVE")):
            datablock.attributes.remove(present)
    if is_any:
        attributes.write(datablock, NAME, "INT", "CURVE", gathered.groups.astype(np.int32))
        attributes.write(datablock, HELD, *_FLOAT_PER_GUIDE, gathered.held.astype(np.float32))
        attributes.write(datablock, TIE, *_FLOAT_PER_GUIDE, gathered.tie_fractions.astype(np.float32))
        attributes.write(datablock, _LENGTH, *_FLOAT_PER_GUIDE, gathered.held * _lengths(datablock))


def scale(datablock, change):
    """Change the stored lengths up to ties as an `Affine` has changed the local coordinates of guides.

    Each segment is scaled as in its direction, and lengths beyond the tip as widths.
    """
    lengths = attributes.read(datablock, _LENGTH, *_FLOAT_PER_GUIDE)
    if lengths is None or not len(lengths):
        return
    scaled = change.widths(lengths)
    if change.scale > 0.0 and not change.preserves_widths:
        points, starts = np.nan_to_num(curves.read_points(datablock)), curves.curve_offsets(datablock)
        now, before = (_segment_lengths(one, starts) for one in (points, change.inverse.points(points)))
        along = np.cumsum(before) - before
        along -= np.repeat(along[starts[:-1]], np.diff(starts))
        left = np.repeat(lengths.astype(np.float64), np.diff(starts)) - along
        parts = np.clip(left / np.maximum(before, 1e-30), 0.0, 1.0)
        beyond = np.maximum(lengths - np.add.reduceat(before, starts[:-1]), 0.0)
        scaled = np.add.reduceat(parts * now, starts[:-1]) + change.widths(beyond)
    attributes.write(datablock, _LENGTH, *_FLOAT_PER_GUIDE, scaled)


def follow_lengths(datablock, before, cuts):
    """Update ties, and the lengths up to ties, of guides that a tool has cut or scaled.

    before: (N, 3), their local points before the change; cuts: whether shorter guides are cut instead of scaled. Points
    keep their fractions of a guide's length, so after a cut a greater part of them is up to the tie.
    """
    groups, tie_fractions, lengths = (
        groups_of(datablock),
        tie_fractions_of(datablock),
        attributes.read(datablock, _LENGTH, *_FLOAT_PER_GUIDE),
    )
    if groups is None:
        return
    former, present = (_along(_even(datablock, points)) for points in (before, curves.read_points(datablock)))
    whole = former[:, -1]
    is_cut = (present[:, -1] < whole) if cuts else np.zeros(len(groups), bool)
    if tie_fractions is not None:
        for guide in np.flatnonzero((tie_fractions > 0.0) & is_cut):
            tie_fractions[guide] = _part_at(present[guide], _length_at(former[guide], tie_fractions[guide]))
        attributes.write(datablock, TIE, *_FLOAT_PER_GUIDE, tie_fractions)
    if lengths is not None:
        scales = np.where(is_cut | (whole <= 0.0), 1.0, present[:, -1] / np.maximum(whole, 1e-30))
        attributes.write(datablock, _LENGTH, *_FLOAT_PER_GUIDE, lengths * scales)


def of_even_points(datablock, tie_fractions):
    """Return tie fractions (G,) of the points that strands follow; tie_fractions: of the guides' own points."""
    points, starts = np.nan_to_num(curves.read_points(datablock)), curves.curve_offsets(datablock)
    found = np.array(tie_fractions, np.float32)
    if (np.diff(starts) == POINT_COUNT).all():
        return found
    along = _along(_even(datablock, points))
    for guide in np.flatnonzero(found > 0.0):
        own = _along(points[None, starts[guide] : starts[guide + 1]])[0]
        found[guide] = _part_at(along[guide], _length_at(own, found[guide]))
    return found


def _even(datablock, points):
    """Return local points (N, 3) of guides as points (G, P, 3) that strands follow."""
    return curves.even_points(
        np.nan_to_num(points), curves.curve_offsets(datablock), lambda: attributes.are_smooth(datablock)
    )


def _along(points):
    """Return the lengths (G, P) from the root to each point (G, P, 3)."""
    lengths = np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=2).cumsum(axis=1)
    return np.pad(lengths, ((0, 0), (1, 0)))


def _length_at(along, part):
    """Return the length at a fraction of the points of a guide with lengths (P,)."""
    return np.interp(part * (len(along) - 1), np.arange(len(along)), along)


def _part_at(along, length):
    """Return the fraction of the points of a guide with lengths (P,) up to a length; 1 beyond the tip."""
    return np.interp(length, along, np.arange(len(along))) / max(len(along) - 1, 1) if length < along[-1] else 1.0


def _segment_lengths(points, starts):
    """Return lengths (N,) float64 from each point to the next point of its guide, zero at tips."""
    found = np.append(np.linalg.norm(np.diff(points.astype(np.float64), axis=0), axis=1), 0.0)
    found[starts[1:] - 1] = 0.0
    return found


def _lengths(datablock):
    """Return the lengths (G,) float64 of guides, at least 1e-30."""
    points, starts = curves.read_points(datablock), curves.curve_offsets(datablock)
    return np.maximum(geometry.strands.ragged_lengths(np.nan_to_num(points), starts), 1e-30)


def add(datablock, gathered):
    """Store new groups of guides, which are apart from equal numbers before; guides with 0 keep their own."""
    present = read(datablock)
    if present is None:
        none = np.zeros(len(gathered.groups), np.float32)
        present = Gathered(none.astype(np.int32), none, none)
    is_new = gathered.groups > 0
    others = np.where(is_new, 0, present.groups)
    groups = np.where(is_new, gathered.groups + others.max(initial=0), others)
    held = np.where(is_new, gathered.held, present.held)
    tie_fractions = np.where(is_new, gathered.tie_fractions, present.tie_fractions)
    write(datablock, Gathered(groups, held, tie_fractions))
