# SPDX-License-Identifier: GPL-3.0-or-later
"""Remove the active style."""

import bpy

from ....data.strands.curves import require_editable
from ....groom.selection import hair_of
from ....settings import style_items
from ..base.hair_operator import HairOperator
from .base import has_styles


class VELLUS_OT_remove_style(HairOperator, bpy.types.Operator):
    """Remove the active style and its keyframes"""

    bl_idname = "vellus.remove_style"
    bl_label = "Remove Style"

    @classmethod
    def applies(cls, context):
        return has_styles(cls, context)

    def change(self, context):
        hair = hair_of(context.object)
        require_editable(hair)
        style_items.remove(hair.vellus, hair.vellus.active_style)
