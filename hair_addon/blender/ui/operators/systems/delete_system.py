# SPDX-License-Identifier: GPL-3.0-or-later
"""Delete the edited hair system."""

import bpy

from ....groom import edits
from ....groom.hair_systems import edited_system, parts_of_system
from ....groom.selection import make_active, surface_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_delete_system(HairOperator, bpy.types.Operator):
    """Delete the edited hair system: its hair, and its guides unless other hair follows them"""

    bl_idname = "vellus.delete_system"
    bl_label = "Delete Hair System"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a hair system in Object Mode.")
        return context.mode == "OBJECT" and edited_system(context.view_layer) is not None

    def change(self, context):
        surface = surface_of(context.object)
        edits.delete(parts_of_system(edited_system(context.view_layer)))
        make_active(surface, context.view_layer)
