# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirroring of combed guides."""

import bpy

from .....core.grooming.guide_tool_settings import MirrorSettings
from ....groom.guides import guide_additions
from ....settings import setting_properties
from .base import GuideTool


class VELLUS_OT_mirror_guides(GuideTool, bpy.types.Operator):
    """Replace the guides of one side of the object with mirrored copies of those on the other side"""

    bl_idname = "vellus.mirror_guides"
    bl_label = "Mirror Guides"
    Settings = MirrorSettings
    __annotations__ = setting_properties.annotations(MirrorSettings)

    def apply(self, guides, settings, depsgraph):
        return guide_additions.mirror(guides, settings, depsgraph)

    def message(self, count):
        return "{count} guides mirrored", {"count": count}
