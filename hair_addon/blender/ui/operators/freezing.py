# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that freeze guides: strokes and guide tools leave frozen points where they are."""

import bpy

from ...groom.guides import frozen_guides
from ...groom.selection import guides_of
from .base.hair_operator import HairOperator, needs_guides


class VELLUS_OT_freeze_selected(HairOperator, bpy.types.Operator):
    """Keep selected guides, or selected points of guides, where they are while others are combed"""

    bl_idname = "vellus.freeze_selected"
    bl_label = "Freeze Selected"
    applies = needs_guides

    def change(self, context):
        return "{count} points are frozen", {"count": frozen_guides.freeze_selected(guides_of(context.object))}


class VELLUS_OT_unfreeze_all(HairOperator, bpy.types.Operator):
    """Let all guides be combed again"""

    bl_idname = "vellus.unfreeze_all"
    bl_label = "Unfreeze All"
    applies = needs_guides

    def change(self, context):
        frozen_guides.unfreeze_all(guides_of(context.object))


class VELLUS_OT_invert_frozen(HairOperator, bpy.types.Operator):
    """Freeze all points of guides that are not frozen, and unfreeze the others"""

    bl_idname = "vellus.invert_frozen"
    bl_label = "Invert Frozen"
    applies = needs_guides

    def change(self, context):
        return "{count} points are frozen", {"count": frozen_guides.invert(guides_of(context.object))}


CLASSES = (VELLUS_OT_freeze_selected, VELLUS_OT_unfreeze_all, VELLUS_OT_invert_frozen)
