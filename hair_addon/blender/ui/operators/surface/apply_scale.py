# SPDX-License-Identifier: GPL-3.0-or-later
"""A scaled surface → the same shape with a scale of one."""

import bpy

from ....groom import edits
from ....groom.selection import surface_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_apply_scale(HairOperator, bpy.types.Operator):
    """Apply the surface's scale to its mesh and leave its guides in place"""

    bl_idname = "vellus.apply_scale"
    bl_label = "Apply Scale"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh, or hair on one, in Object Mode.")
        return context.mode == "OBJECT" and surface_of(context.object) is not None

    def change(self, context):
        edits.apply_scale(surface_of(context.object), context.view_layer)
