# SPDX-License-Identifier: GPL-3.0-or-later
"""Let delivered hair follow its guides again."""

import bpy

from ....data.strands import curves, delivered_hair
from ....groom.selection import guides_of
from ....io import delivery
from ..base.hair_operator import HairOperator


class VELLUS_OT_remove_delivery(HairOperator, bpy.types.Operator):
    """Let the hair follow its guides again, in place of the delivered frames. Their file stays"""

    bl_idname = "vellus.remove_delivery"
    bl_label = "Remove Delivered Hair"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select guides whose hair has been delivered.")
        guides = guides_of(context.object)
        return guides is not None and any(map(delivered_hair.is_delivered, curves.followers(guides)))

    def change(self, context):
        delivery.take_off(guides_of(context.object))
