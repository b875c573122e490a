# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoothing of combed guides."""

import bpy

from .....core.grooming.guide_tool_settings import SmoothSettings
from ....groom.guides import guide_tools
from ....settings import setting_properties
from .base import GuideTool


class VELLUS_OT_smooth_guides(GuideTool, bpy.types.Operator):
    """Smooth guides along their length; roots and lengths are kept"""

    bl_idname = "vellus.smooth_guides"
    bl_label = "Smooth Guides"
    Settings = SmoothSettings
    __annotations__ = setting_properties.annotations(SmoothSettings)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.smooth(guides, settings, depsgraph)
