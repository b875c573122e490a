# SPDX-License-Identifier: GPL-3.0-or-later
"""Length of combed guides."""

import bpy

from .....core.grooming.guide_tool_settings import LengthSettings
from ....groom.guides import guide_tools
from ....settings import setting_properties
from ... import setting_rows
from .base import GuideTool


class VELLUS_OT_guide_length(GuideTool, bpy.types.Operator):
    """Scale the length of guides, set it, or keep it within a limit; combing is kept"""

    bl_idname = "vellus.guide_length"
    bl_label = "Guide Length"
    Settings = LengthSettings
    __annotations__ = setting_properties.annotations(LengthSettings)

    def prefill(self, guides):
        if not self.properties.is_property_set("length"):
            self.length = guide_tools.median_length(guides)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.change_lengths(guides, settings, depsgraph)

    def draw_settings(self, layout):
        for name in ("method", "factor" if self.method == "SCALE" else "length", "shorten"):
            setting_rows.row(layout, self.properties, name)
