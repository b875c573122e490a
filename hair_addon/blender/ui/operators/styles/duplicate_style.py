# SPDX-License-Identifier: GPL-3.0-or-later
"""The active style once more, after it."""

import bpy

from ....data.strands.curves import require_editable
from ....groom.selection import hair_of
from ....settings import style_items
from ..base.hair_operator import HairOperator
from .base import has_styles


class VELLUS_OT_duplicate_style(HairOperator, bpy.types.Operator):
    """Duplicate the active style, without its keyframes; the copy has another random seed"""

    bl_idname = "vellus.duplicate_style"
    bl_label = "Duplicate Style"

    @classmethod
    def applies(cls, context):
        return has_styles(cls, context)

    def change(self, context):
        hair = hair_of(context.object)
        require_editable(hair)
        style_items.duplicate(hair.vellus, hair.vellus.active_style)
