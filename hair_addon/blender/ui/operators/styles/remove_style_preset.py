# SPDX-License-Identifier: GPL-3.0-or-later
"""Delete a saved style preset."""

import bpy

from ....settings import properties, saved_styles
from ..base.hair_operator import HairOperator


class VELLUS_OT_remove_style_preset(HairOperator, bpy.types.Operator):
    """Delete a saved style preset permanently"""

    bl_idname = "vellus.remove_style_preset"
    bl_label = "Remove Style Preset"
    bl_options = {"REGISTER", "INTERNAL"}
    __annotations__ = {"name": properties.text("Name", "Saved style preset")}

    def change(self, _context):
        saved_styles.remove(self.name)
