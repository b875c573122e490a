# SPDX-License-Identifier: GPL-3.0-or-later
"""Lifting of combed guides."""

import bpy

from .....core.grooming.guide_tool_settings import LiftSettings
from ....groom.guides import guide_tools
from ....settings import setting_properties
from .base import GuideTool


class VELLUS_OT_lift_guides(GuideTool, bpy.types.Operator):
    """Turn guides toward the surface normal, most at their roots; lengths are kept"""

    bl_idname = "vellus.lift_guides"
    bl_label = "Lift Guides"
    Settings = LiftSettings
    __annotations__ = setting_properties.annotations(LiftSettings)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.lift(guides, settings, depsgraph)
