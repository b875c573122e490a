# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of named selections of guides."""

import bpy

from ...groom.guides import selected_guides
from ...groom.selection import guides_of
from ...settings import properties
from .base.hair_operator import HairOperator, needs_guides

_NAME = "Name of the selection"


class VELLUS_OT_save_selection(HairOperator, bpy.types.Operator):
    """Save the selected guides, or points of guides, under a name. A selection of this name is replaced"""

    bl_idname = "vellus.save_selection"
    bl_label = "Save Selection"
    __annotations__ = {"name": properties.text("Name", _NAME)}
    applies = needs_guides

    def change(self, context):
        name = self.name or "Selection"
        return "{count} points are saved", {"count": selected_guides.save(guides_of(context.object), name)}


class VELLUS_OT_select_saved(HairOperator, bpy.types.Operator):
    """Select the guides of a saved selection"""

    bl_idname = "vellus.select_saved"
    bl_label = "Select Saved"
    __annotations__ = {
        "name": properties.text("Name", _NAME),
        "mode": properties.choice(
            "Mode",
            "How the saved selection changes the present one",
            {"SET": "Set", "ADD": "Extend", "REMOVE": "Deselect"},
        ),
    }
    applies = needs_guides

    def change(self, context):
        count = selected_guides.select(guides_of(context.object), self.name, self.mode)
        return "{count} points are selected", {"count": count}


class VELLUS_OT_remove_selection(HairOperator, bpy.types.Operator):
    """Remove a saved selection; guides do not change"""

    bl_idname = "vellus.remove_selection"
    bl_label = "Remove Saved Selection"
    __annotations__ = {"name": properties.text("Name", _NAME)}
    applies = needs_guides

    def change(self, context):
        selected_guides.remove(guides_of(context.object), self.name)


CLASSES = (VELLUS_OT_save_selection, VELLUS_OT_select_saved, VELLUS_OT_remove_selection)
