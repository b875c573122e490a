# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits of strokes: after each event, frozen points of combed guides return to where they were."""

import bpy

from ..data.strands import attributes, curves, frozen_points
from ..layers import recording
from . import reported

_MODES = {"SCULPT_CURVES", "EDIT"}


def limited(guides, points):
    """Restore frozen points of combed guides; returns all points (N, 3), which are `points` if none has moved."""
    if not _is_edited(guides):
        return points
    restored = frozen_points.restored(guides, reported.former_points_of(guides), points)
    if restored is points:
        return points
    attributes.write(guides, "position", "FLOAT_VECTOR", "POINT", restored)
    guides.update_tag()
    reported.note_points(guides, restored)
    return restored


def _is_edited(guides):
    """Whether an artist edits guides, and neither settings nor layers have just moved them."""
    if attributes.is_from_library(guides) or frozen_points.FROZEN not in guides.attributes:
        return False
    if not any(user.data == guides and user.mode in _MODES for user in bpy.data.objects):
        return False
    return recording.is_edited(guides) if len(guides.vellus.layers) else curves.is_combed(guides)
