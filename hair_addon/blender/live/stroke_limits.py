# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits of strokes: after each event frozen points return to where they were, and guides stay outside the surface."""

import bpy

from ..data.strands import attributes, curves, frozen_points
from ..groom.guides import outside_guides
from ..layers import recording
from . import last_update

_MODES = {"SCULPT_CURVES", "EDIT"}


def begin(objects):
    """Note the points of guides among objects that entered a mode in which they are combed, before the first stroke."""
    for guides in {o.data for o in objects if o.type == "CURVES" and o.mode in _MODES}:
        if guides.vellus.kind == "GUIDES" and last_update.points_of(guides) is None:
            last_update.note_points(guides, curves.read_points(guides))


def limited(guides, points, depsgraph):
    """Limit the points (N, 3) of combed guides, write and return them; return `points` if none is moved."""
    former = last_update.former_points_of(guides)
    if former is None or not _is_edited(guides, points):
        return points
    allowed = frozen_points.restored(guides, former, points)
    if guides.vellus.keeps_outside:
        pushed = outside_guides.pushed_out(guides, former, allowed, depsgraph)
        allowed = frozen_points.restored(guides, former, pushed)
    if allowed is points:
        return points
    write(guides, allowed)
    return allowed


def write(guides, points):
    """Write points (N, 3) of guides, which do not count as moved."""
    attributes.write(guides, "position", "FLOAT_VECTOR", "POINT", points)
    guides.update_tag()
    last_update.note_points(guides, points)


def is_combed(guides):
    """Whether guides of this file are in a mode in which they are combed."""
    if attributes.is_from_library(guides):
        return False
    return any(user.data == guides and user.mode in _MODES for user in bpy.data.objects)


def _is_edited(guides, points):
    """Return whether an artist moved limited guides to points (N, 3), and no setting or layer did."""
    if not guides.vellus.keeps_outside and frozen_points.FROZEN not in guides.attributes:
        return False
    if not is_combed(guides):
        return False
    if len(guides.vellus.layers):
        return recording.is_edited(guides, points)
    return curves.is_hand_made(guides) or curves.is_combed(guides)
