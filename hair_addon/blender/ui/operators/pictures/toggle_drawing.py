# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair shaded by Vellus ↔ hair as Blender draws curves."""

import bpy

from ....groom.selection import drawn_with
from ....materials import looks
from ..base.hair_operator import HairOperator


class VELLUS_OT_toggle_drawing(HairOperator, bpy.types.Operator):
    """Draw the active hair with its shading model or as Blender's curves; without active hair, all hair in the file"""

    bl_idname = "vellus.toggle_drawing"
    bl_label = "Toggle Hair Shading"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("There is no hair in this file.")
        return bool(drawn_with(context.object))

    def change(self, context):
        hair = drawn_with(context.object)
        looks.show_shaded(hair, not all(datablock.vellus.is_drawn for datablock in hair))
