# SPDX-License-Identifier: GPL-3.0-or-later
"""More or fewer combed guides."""

import bpy

from .....core.grooming.guide_tool_settings import CountSettings
from ....groom.guides import guide_additions
from ....settings import setting_properties
from ... import setting_rows
from .base import GuideTool


class VELLUS_OT_change_guide_count(GuideTool, bpy.types.Operator):
    """Add guides between those that are there, or remove the most crowded ones; all others stay as they are combed"""

    bl_idname = "vellus.change_guide_count"
    bl_label = "Change Guide Count"
    Settings = CountSettings
    __annotations__ = setting_properties.annotations(CountSettings)

    def prefill(self, guides):
        if not self.properties.is_property_set("guide_count"):
            self.guide_count = max(len(guides.curves), 1)

    def apply(self, guides, settings, depsgraph):
        return guide_additions.change_count(guides, settings, depsgraph)

    def message(self, count):
        return "{count} guides", {"count": count}

    def draw_settings(self, layout):
        for name in ("method", "factor" if self.method == "FACTOR" else "guide_count"):
            setting_rows.row(layout, self.properties, name)
