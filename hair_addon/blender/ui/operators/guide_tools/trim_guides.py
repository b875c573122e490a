# SPDX-License-Identifier: GPL-3.0-or-later
"""Trimming of combed guides by an object."""

import bpy

from .....core.grooming.guide_tool_settings import TrimSettings
from ....groom.guides import guide_tools
from ....groom.selection import surface_of
from ....settings import setting_properties
from ... import setting_rows
from .base import GuideTool


class VELLUS_OT_trim_guides(GuideTool, bpy.types.Operator):
    """Cut guides where the faces of a mesh, or the XY plane of another object such as an empty, cross them"""

    bl_idname = "vellus.trim_guides"
    bl_label = "Trim Guides"
    Settings = TrimSettings
    __annotations__ = setting_properties.annotations(TrimSettings)

    def invoke(self, context, event):
        """Cut with the object that is selected too, or open a dialog to pick one."""
        surface = surface_of(context.object)
        others = [o for o in context.selected_objects if o not in (context.object, surface) and o.type != "CURVES"]
        if len(others) == 1:
            self.cutter = others[0].name
        if not self.cutter and not bpy.app.background:
            return context.window_manager.invoke_props_dialog(self)
        return super().invoke(context, event)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.trim(guides, settings, depsgraph)

    def draw_settings(self, layout):
        setting_rows.search_row(layout, self.properties, "cutter", bpy.data, "objects")
