# SPDX-License-Identifier: GPL-3.0-or-later
"""Select the guides of a mesh or hair."""

import bpy

from .....core.errors import HairError
from ....groom.selection import guides_of, make_active, object_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_select_guides(HairOperator, bpy.types.Operator):
    """Select the guides of the active mesh or hair"""

    bl_idname = "vellus.select_guides"
    bl_label = "Select Guides"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh with guides, or hair that follows guides, in Object Mode.")
        return context.mode == "OBJECT" and guides_of(context.object) is not None

    def change(self, context):
        guides = object_of(guides_of(context.object), context.view_layer)
        if guides is None:
            raise HairError("The guides have no object in this view layer: restore the guides.")
        make_active(guides, context.view_layer)
