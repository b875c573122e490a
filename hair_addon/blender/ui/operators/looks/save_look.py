# SPDX-License-Identifier: GPL-3.0-or-later
"""The active hair's appearance → a saved look, for every file."""

import bpy

from ....groom.selection import hair_of
from ....settings import properties, saved_looks
from ..base.hair_operator import HairOperator, needs_hair


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
