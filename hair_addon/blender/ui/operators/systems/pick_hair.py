# SPDX-License-Identifier: GPL-3.0-or-later
"""Selection of hair by a click, as for objects that Blender draws."""

import bpy

from ....render.viewport import viewport
from ....settings.translations import CONTEXT


class VELLUS_OT_pick_hair(bpy.types.Operator):
    """Select the hair under the mouse pointer; hold Shift to extend the selection"""

    bl_idname = "vellus.pick_hair"
    bl_label = "Pick Hair"
    bl_options = {"UNDO", "INTERNAL"}
    bl_translation_context = CONTEXT

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT" and context.region_data is not None

    def invoke(self, context, event):
        """Pass the click through to Blender if there is no hair."""
        picked = viewport.hair_at(context, event.mouse_region_x, event.mouse_region_y)
        if picked is None:
            return {"CANCELLED", "PASS_THROUGH"}
        is_off = event.shift and picked.select_get() and context.view_layer.objects.active == picked
        for other in () if event.shift else context.selected_objects:
            other.select_set(False)
        picked.select_set(not is_off)
        context.view_layer.objects.active = picked
        return {"FINISHED"}
