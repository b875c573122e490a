# SPDX-License-Identifier: GPL-3.0-or-later
"""Draping of combed guides."""

import bpy

from .....core.grooming.guide_tool_settings import DrapeSettings
from ....data import scene
from ....groom.dynamics import guide_draping
from ....groom.selection import guides_of, surface_of
from ....settings import setting_properties
from ..base.modal import LongOperator
from .base import GuideTool


class VELLUS_OT_drape_guides(LongOperator, GuideTool, bpy.types.Operator):
    """Let guides fall under gravity until they rest on the surface, and keep that as their shape"""

    bl_idname = "vellus.drape_guides"
    bl_label = "Drape Guides"
    Settings = DrapeSettings
    __annotations__ = setting_properties.annotations(DrapeSettings)

    def seconds(self, context):
        surface = surface_of(context.object)
        face_count = 0 if surface is None else scene.triangle_count(surface, context.view_layer)
        return guide_draping.seconds(guides_of(context.object), self._settings(), face_count)

    def work(self, context):
        depsgraph = context.evaluated_depsgraph_get()
        return guide_draping.draping(guides_of(context.object), self._settings(), depsgraph)

    def message(self, made):
        return GuideTool.message(self, made)

    def _settings(self):
        return setting_properties.to_settings(self, DrapeSettings)
