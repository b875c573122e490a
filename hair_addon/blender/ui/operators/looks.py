# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of looks: presets and saved ones."""

import bpy

from ....core.shading.presets import PRESETS
from ...groom.selection import hair_of
from ...materials import looks
from ...settings import properties, saved_looks
from .base.hair_operator import HairOperator, needs_hair


class VELLUS_OT_apply_preset(HairOperator, bpy.types.Operator):
    """Apply a built-in look to the active hair"""

    bl_idname = "vellus.apply_preset"
    bl_label = "Apply Look"
    __annotations__ = {
        "preset": properties.choice(
            "Look", "Look to apply", {identifier: label for identifier, (label, _look) in PRESETS.items()}
        )
    }
    applies = needs_hair

    def change(self, context):
        label, look = PRESETS[self.preset]
        looks.apply_look(hair_of(context.object), look)
        return label, {}


class VELLUS_OT_apply_saved_look(HairOperator, bpy.types.Operator):
    """Apply a saved look to the active hair"""

    bl_idname = "vellus.apply_saved_look"
    bl_label = "Apply Saved Look"
    __annotations__ = {"name": properties.text("Name", "Saved look")}
    applies = needs_hair

    def change(self, context):
        looks.apply_look(hair_of(context.object), saved_looks.read(self.name))


class VELLUS_OT_save_look(HairOperator, bpy.types.Operator):
    """Save the active hair's look for use in every file"""

    bl_idname = "vellus.save_look"
    bl_label = "Save Look"
    bl_options = {"REGISTER"}
    __annotations__ = {"name": properties.text("Name", "Name of the look")}
    applies = needs_hair

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def change(self, context):
        saved_looks.write(self.name, properties.own_look_of(hair_of(context.object).vellus))
        return "Look {name} saved", {"name": self.name}


class VELLUS_OT_remove_look(HairOperator, bpy.types.Operator):
    """Delete a saved look permanently"""

    bl_idname = "vellus.remove_look"
    bl_label = "Remove Look"
    bl_options = {"REGISTER", "INTERNAL"}
    __annotations__ = {"name": properties.text("Name", "Saved look")}

    def change(self, _context):
        saved_looks.remove(self.name)


CLASSES = (
    VELLUS_OT_apply_preset,
    VELLUS_OT_apply_saved_look,
    VELLUS_OT_save_look,
    VELLUS_OT_remove_look,
)
