# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw Flow: lines that are drawn on the surface."""

import bpy

from ....groom.guides import line_drawing
from ....groom.selection import guides_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_draw_flow(HairOperator, bpy.types.Operator):
    """Draw lines on the surface in whose direction guides grow, with Blender's Draw tool; or stop drawing"""

    bl_idname = "vellus.draw_flow"
    bl_label = "Draw Flow"

    @classmethod
    def applies(cls, context):
        if line_drawing.drawn_for(context.object) is not None:
            return True
        cls.poll_message_set("Select guides that are to follow lines.")
        return guides_of(context.object) is not None

    def change(self, context):
        if line_drawing.drawn_for(context.object) is not None:
            line_drawing.stop(context)
        else:
            line_drawing.draw_flow(guides_of(context.object), context)
