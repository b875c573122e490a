# SPDX-License-Identifier: GPL-3.0-or-later
"""Select the hair of a mesh or guides."""

import bpy

from .....core.errors import HairError
from ....groom.selection import hair_of, make_active, object_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_select_hair(HairOperator, bpy.types.Operator):
    """Select the hair on the active mesh, or the hair that follows the active guides"""

    bl_idname = "vellus.select_hair"
    bl_label = "Select Hair"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh with hair, or guides that hair follows, in Object Mode.")
        return context.mode == "OBJECT" and hair_of(context.object) is not None

    def change(self, context):
        hair = object_of(hair_of(context.object), context.view_layer)
        if hair is None:
            raise HairError("The hair has no object in this view layer.")
        make_active(hair, context.view_layer)
