# SPDX-License-Identifier: GPL-3.0-or-later
"""The active hair's styles → a saved preset, for every file."""

import bpy

from ....groom.selection import hair_of
from ....groom.transfer import groom_settings
from ....settings import properties, saved_styles
from ..base.hair_operator import HairOperator, needs_hair


class VELLUS_OT_save_style_preset(HairOperator, bpy.types.Operator):
    """Save the active hair's styles for use in every file"""

    bl_idname = "vellus.save_style_preset"
    bl_label = "Save Style Preset"
    bl_options = {"REGISTER"}
    __annotations__ = {"name": properties.text("Name", "Name of the preset")}
    applies = needs_hair

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def change(self, context):
        saved_styles.write(self.name, groom_settings.settings_of(hair_of(context.object)))
        return "Style preset {name} saved", {"name": self.name}
