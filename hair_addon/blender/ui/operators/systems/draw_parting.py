# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw Parting: lines that are drawn on the surface."""

import bpy

from ....groom.guides import line_drawing
from ....groom.selection import hair_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_draw_parting(HairOperator, bpy.types.Operator):
    """Draw lines on the surface that part the hair, with Blender's Draw tool; or stop drawing"""

    bl_idname = "vellus.draw_parting"
    bl_label = "Draw Parting"

    @classmethod
    def applies(cls, context):
        if line_drawing.drawn_for(context.object) is not None:
            return True
        cls.poll_message_set("Select hair to part.")
        return hair_of(context.object) is not None

    def change(self, context):
        if line_drawing.drawn_for(context.object) is not None:
            line_drawing.stop(context)
        else:
            line_drawing.draw_parting(hair_of(context.object), context)
