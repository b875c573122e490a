# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw Parting and Draw Flow: lines that are drawn on the surface."""

import bpy

from ....groom.guides import line_drawing
from ....groom.selection import guides_of, hair_of
from ..base.hair_operator import HairOperator


class _DrawLines(HairOperator):
    """Mixin of operators that draw the lines of what is active, or stop drawing them."""

    asked = ""  # to select what the lines are for

    @staticmethod
    def target_of(active):
        """The Curves of the active object that lines are drawn for, None where it has none."""
        raise NotImplementedError

    @staticmethod
    def begin(target, context):
        """Begin to draw lines of Curves. Raises `HairError`."""
        raise NotImplementedError

    @classmethod
    def applies(cls, context):
        if line_drawing.drawn_for(context.object) is not None:
            return True
        cls.poll_message_set(cls.asked)
        return cls.target_of(context.object) is not None

    def change(self, context):
        if line_drawing.drawn_for(context.object) is not None:
            line_drawing.stop(context)
        else:
            self.begin(self.target_of(context.object), context)


class VELLUS_OT_draw_parting(_DrawLines, bpy.types.Operator):
    """Draw lines on the surface that part the hair, with Blender's Draw tool; or stop drawing"""

    bl_idname = "vellus.draw_parting"
    bl_label = "Draw Parting"

    asked = "Select hair to part."
    target_of = staticmethod(hair_of)
    begin = staticmethod(line_drawing.draw_parting)


class VELLUS_OT_draw_flow(_DrawLines, bpy.types.Operator):
    """Draw lines on the surface in whose direction guides grow, with Blender's Draw tool; or stop drawing"""

    bl_idname = "vellus.draw_flow"
    bl_label = "Draw Flow"

    asked = "Select guides that are to follow lines."
    target_of = staticmethod(guides_of)
    begin = staticmethod(line_drawing.draw_flow)
