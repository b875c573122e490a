# SPDX-License-Identifier: GPL-3.0-or-later
"""The selection of guides → the mask of the active style."""

import bpy

from ....groom.selection import hair_of
from ....groom.styles import painted_masks
from ..base.hair_operator import HairOperator
from .base import active_style_of


class VELLUS_OT_mask_from_selection(HairOperator, bpy.types.Operator):
    """Limit the active style to the guides that are selected, as painted in Sculpt Mode"""

    bl_idname = "vellus.mask_from_selection"
    bl_label = "Mask from Selected Guides"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair with styles and guides.")
        hair = hair_of(context.object)
        has_guides = hair is not None and hair.vellus.guide_curves is not None
        return has_guides and active_style_of(context) is not None

    def change(self, context):
        count = painted_masks.from_selection(hair_of(context.object), active_style_of(context))
        return "{count} guides in the mask", {"count": count}
