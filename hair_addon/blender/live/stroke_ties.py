# SPDX-License-Identifier: GPL-3.0-or-later
"""Ties stay where they are on gathered guides that brushes cut or lengthen."""

import bpy

from ..data.strands import attributes, gathered_groups
from . import last_update, stale_marks

_MODES = {"SCULPT_CURVES", "EDIT"}


def follow(guides, depsgraph):
    """Update the ties of guides that a stroke has moved, and mark the hair that they part."""
    former = last_update.former_points_of(guides)
    if former is None or gathered_groups.NAME not in guides.attributes or attributes.is_from_library(guides):
        return
    is_edited = any(user.data == guides and user.mode in _MODES for user in bpy.data.objects)
    if is_edited and gathered_groups.follow_stroke(guides, former):
        guides.update_tag()
        stale_marks.follow_partings({guides}, set(), depsgraph)
