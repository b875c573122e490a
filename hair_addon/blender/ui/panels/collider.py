# SPDX-License-Identifier: GPL-3.0-or-later
"""Physics properties of a mesh object, where guides may collide with it."""

import bpy

from ...settings.translations import CONTEXT
from .. import setting_rows
from .tab import split


class VELLUS_PT_collider(bpy.types.Panel):
    """How simulated guides collide with this object"""

    bl_label = "Hair Collision"
    bl_idname = "VELLUS_PT_collider"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "physics"
    bl_options = {"DEFAULT_CLOSED"}
    bl_translation_context = CONTEXT

    @classmethod
    def poll(cls, context):
        is_mesh = context.object is not None and context.object.type == "MESH"
        return is_mesh and any(curves.vellus.kind == "GUIDES" for curves in bpy.data.hair_curves)

    def draw(self, context):
        setting_rows.collider_rows(split(self.layout), context.object.vellus)


CLASSES = (VELLUS_PT_collider,)
