# SPDX-License-Identifier: GPL-3.0-or-later
"""Attraction of combed guides to their surface."""

import bpy

from .....core.grooming.guide_tool_settings import AttractSettings
from ....groom.guides import guide_tools
from ....settings import setting_properties
from .base import GuideTool

_PART = 0.02  # of the guides' length: a clearance that fits a surface of any size


class VELLUS_OT_attract_guides(GuideTool, bpy.types.Operator):
    """Turn guides toward the surface and keep them above it; lengths are kept"""

    bl_idname = "vellus.attract_guides"
    bl_label = "Attract Guides"
    Settings = AttractSettings
    __annotations__ = setting_properties.annotations(AttractSettings)

    def prefill(self, guides):
        if not self.properties.is_property_set("clearance"):
            self.clearance = _PART * guide_tools.median_length(guides)

    def message(self, count):
        if not count and not self.amount:
            return "No guides changed: at an amount of 0 they stay as they are", {}
        return super().message(count)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.attract(guides, settings, depsgraph)
