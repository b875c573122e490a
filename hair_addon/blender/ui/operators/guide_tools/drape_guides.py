# SPDX-License-Identifier: GPL-3.0-or-later
"""Draping of combed guides."""

import bpy

from .....core.grooming.guide_tool_settings import DrapeSettings
from ....groom import guide_tools
from ....settings import setting_properties
from .base import GuideTool


class VELLUS_OT_drape_guides(GuideTool, bpy.types.Operator):
    """Let guides fall under gravity until they rest on the surface, and keep that as their shape"""

    bl_idname = "vellus.drape_guides"
    bl_label = "Drape Guides"
    Settings = DrapeSettings
    __annotations__ = setting_properties.annotations(DrapeSettings)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.drape(guides, settings, depsgraph)
