# SPDX-License-Identifier: GPL-3.0-or-later
"""Order of the active hair's styles."""

import bpy

from ....data.strands.curves import require_editable
from ....groom.selection import hair_of
from ....settings import properties, style_items
from ..base.hair_operator import HairOperator
from .base import has_styles


class VELLUS_OT_move_style(HairOperator, bpy.types.Operator):
    """Move the active style up or down; styles are applied from top to bottom"""

    bl_idname = "vellus.move_style"
    bl_label = "Move Style"
    __annotations__ = {
        "direction": properties.choice("Direction", "Direction to move the style in", {"UP": "Up", "DOWN": "Down"})
    }

    @classmethod
    def applies(cls, context):
        return has_styles(cls, context)

    def change(self, context):
        hair = hair_of(context.object)
        require_editable(hair)
        state = hair.vellus
        to = state.active_style + (1 if self.direction == "DOWN" else -1)
        if 0 <= to < len(state.styles):
            style_items.move(state, state.active_style, to)
