# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides whose object was deleted → guides that can be selected."""

import bpy

from ....groom import edits
from ....groom.selection import guides_of, object_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_restore_guides(HairOperator, bpy.types.Operator):
    """Restore the deleted object of the active hair's guides"""

    bl_idname = "vellus.restore_guides"
    bl_label = "Restore Guides"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair whose guides were deleted.")
        guides = guides_of(context.object)
        return guides is not None and object_of(guides, context.view_layer) is None

    def change(self, context):
        edits.restore_object(guides_of(context.object))
