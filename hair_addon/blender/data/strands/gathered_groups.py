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
_LEAST_CHANGE = 1e-4  # of a guide's length; smaller changes in one event are of strokes that preserve lengths
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


def ties_of(datablock):
    """Return the stored ties and lengths up to ties of guides, for `write_ties`."""
    return [(name, attributes.read(datablock, name, *_FLOAT_PER_GUIDE)) for name in (TIE, _LENGTH)]


def write_ties(datablock, ties):
    """Store ties and lengths from `ties_of`."""
    for name, values in ties:
        if values is not None and len(values) == len(datablock.curves):
            attributes.write(datablock, name, *_FLOAT_PER_GUIDE, values)


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
    _follow(datablock, before, lambda former, present: (_along(present)[:, -1] < _along(former)[:, -1]) & cuts)


def follow_stroke(datablock, before, moved):
    """Update ties as `follow_lengths` after a brush that may have cut, extended or scaled guides; returns whether any
    guide has another tie or length up to it.

    before: (N, 3), their local points before the stroke's last event; moved: (N, 3), where the brush has moved them,
    and limits may have moved them back since.
    """
    if groups_of(datablock) is None or not len(before) == len(moved) == len(datablock.points):
        return False
    return _follow(
        datablock, before, lambda former, _now: _is_extended_or_cut(former, _even(datablock, moved)), _LEAST_CHANGE
    )


def _is_extended_or_cut(former, present):
    """Return (G,) bool: guides whose shorter points, former or present (G, P, 3), lie on the longer ones, rather than
    being the other ones scaled about the root.
    """
    before, now = _along(former), _along(present)
    is_cut = (now[:, -1] < before[:, -1])[:, None]
    longer, shorter = (np.where(is_cut[..., None], *pair) for pair in ((former, present), (present, former)))
    along, places = (np.where(is_cut, *pair) for pair in ((before, now), (now, before)))
    cut = _at_numbers(longer, _numbers_at(along, places))
    scales = now[:, -1] / np.maximum(before[:, -1], 1e-30)
    scaled = former[:, :1] + scales[:, None, None] * (former - former[:, :1])
    return np.linalg.norm(shorter - cut, axis=2).max(axis=1) < np.linalg.norm(present - scaled, axis=2).max(axis=1)


def _numbers_at(along, places):
    """Return the fractional numbers (G, K) of the points of guides, at lengths (G, K); along: as from `_along`."""
    whole, guides = np.maximum(along[:, -1:], 1e-30), 2.0 * np.arange(len(along))[:, None]
    numbers = np.arange(along.size).reshape(along.shape)
    found = np.interp(
        (guides + np.clip(places / whole, 0.0, 1.0)).ravel(), (guides + along / whole).ravel(), numbers.ravel()
    )
    return found.reshape(places.shape) - numbers[:, :1]


def _at_numbers(points, numbers):
    """Return the places (G, K, 3) on guides (G, P, 3) at fractional numbers (G, K) of their points."""
    first = np.minimum(numbers.astype(int), points.shape[1] - 2)
    rows, part = np.arange(len(points))[:, None], (numbers - first)[..., None]
    return (1.0 - part) * points[rows, first] + part * points[rows, first + 1]


def _follow(datablock, before, is_cut_of, least_change=0.0):
    """Update ties as `follow_lengths`; returns whether any has changed.

    is_cut_of: (points before, points now), each (G, P, 3) → (G,) bool: guides that are cut or extended at their tips;
    least_change: of a guide's length.
    """
    groups, tie_fractions, lengths = (
        groups_of(datablock),
        tie_fractions_of(datablock),
        attributes.read(datablock, _LENGTH, *_FLOAT_PER_GUIDE),
    )
    if groups is None:
        return False
    shapes = [_even(datablock, points) for points in (before, curves.read_points(datablock))]
    former, present = map(_along, shapes)
    whole = former[:, -1]
    if (np.abs(present[:, -1] - whole) <= least_change * whole).all():
        return False
    is_cut = is_cut_of(*shapes)
    if tie_fractions is not None:
        is_moved = (tie_fractions > 0.0) & is_cut
        last = former.shape[1] - 1
        places = _at_numbers(former[..., None], last * tie_fractions[:, None])[..., 0]
        parts = np.where(places < present[:, -1:], _numbers_at(present, places) / last, 1.0)
        tie_fractions = np.where(is_moved, parts[:, 0], tie_fractions).astype(np.float32)
        attributes.write(datablock, TIE, *_FLOAT_PER_GUIDE, tie_fractions)
    if lengths is not None:
        scales = np.where(is_cut | (whole <= 0.0), 1.0, present[:, -1] / np.maximum(whole, 1e-30))
        attributes.write(datablock, _LENGTH, *_FLOAT_PER_GUIDE, lengths * scales)
    return True


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
