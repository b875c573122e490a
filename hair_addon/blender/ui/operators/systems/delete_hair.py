# SPDX-License-Identifier: GPL-3.0-or-later
"""Delete hair and its guides."""

import bpy

from ....groom import edits
from ....groom.selection import make_active, parts_of, surface_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_delete_hair(HairOperator, bpy.types.Operator):
    """Delete the active hair with its guides, or all hair on the active mesh"""

    bl_idname = "vellus.delete_hair"
    bl_label = "Delete Hair"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair, guides, or a mesh with hair, in Object Mode.")
        return context.mode == "OBJECT" and bool(parts_of(context.object))

    def change(self, context):
        surface, parts = surface_of(context.object), parts_of(context.object)
        edits.delete(parts)
        if surface is not None and surface.name in context.view_layer.objects:
            make_active(surface, context.view_layer)
        return "{count} objects deleted", {"count": len(parts)}
