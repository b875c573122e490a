# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes of combed guides copied from one region to another."""

import bpy

from .....core.grooming.guide_tool_settings import CopySettings
from ....groom.guides import guide_tools
from ....groom.selection import guides_of, surface_of
from ....settings import setting_properties
from ... import setting_rows
from .base import GuideTool


class VELLUS_OT_copy_guide_shape(GuideTool, bpy.types.Operator):
    """Give guides the shape of the selected guides, or of those in a vertex group, turned with the surface"""

    bl_idname = "vellus.copy_guide_shape"
    bl_label = "Copy Guide Shape"
    Settings = CopySettings
    __annotations__ = setting_properties.annotations(CopySettings)

    def invoke(self, context, event):
        """Copy, or open a dialog where nothing says what."""
        if not self.source and not bpy.app.background and not guide_tools.is_any_selected(guides_of(context.object)):
            return context.window_manager.invoke_props_dialog(self)
        return super().invoke(context, event)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.copy_shape(guides, settings, depsgraph)

    def draw(self, context):
        surface = surface_of(context.object)
        if surface is not None:
            for name in ("source", "target"):
                setting_rows.search_row(self.layout, self.properties, name, surface, "vertex_groups")
        for name in ("mapping", "copy_length", "amount"):
            setting_rows.row(self.layout, self.properties, name)
