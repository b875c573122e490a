# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface → the same with a UV map without overlaps."""

import bpy

from ....groom import edits
from ....groom.selection import surface_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_make_uv_map(HairOperator, bpy.types.Operator):
    """Unwrap the surface to a new UV map without overlaps, which hair nodes use to find roots"""

    bl_idname = "vellus.make_uv_map"
    bl_label = "Make UV Map"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh, or hair on one, in Object Mode.")
        return context.mode == "OBJECT" and surface_of(context.object) is not None

    def change(self, context):
        edits.make_uv_map(surface_of(context.object), context.view_layer)
