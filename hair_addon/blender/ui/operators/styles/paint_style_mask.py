# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's paint modes for the mask of the active style."""

import bpy

from ....groom.selection import hair_of
from ....groom.styles import painted_masks
from ..base.hair_operator import HairOperator
from .base import active_style_of


class VELLUS_OT_paint_style_mask(HairOperator, bpy.types.Operator):
    """Paint where the active style acts with Blender's brushes, while the hair follows; or stop painting"""

    bl_idname = "vellus.paint_style_mask"
    bl_label = "Paint Style Mask"

    @classmethod
    def applies(cls, context):
        if painted_masks.is_painting(context.object):
            return True
        cls.poll_message_set("Select hair with styles, on a surface, in Object Mode.")
        hair = hair_of(context.object)
        has_place = context.mode == "OBJECT" and hair is not None and hair.surface is not None
        return has_place and active_style_of(context) is not None

    def change(self, context):
        if painted_masks.is_painting(context.object):
            painted_masks.stop(context.object, context)
        else:
            painted_masks.paint(hair_of(context.object), active_style_of(context), context)
