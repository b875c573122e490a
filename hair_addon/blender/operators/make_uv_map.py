# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface without a UV map that leads to its faces → one with."""

import bpy

from .. import systems
from ..selection import surface_of
from .base import HairOperator


class VELLUS_OT_make_uv_map(HairOperator, bpy.types.Operator):
    """Unfold the surface into a new UV map without overlaps, by which hair nodes find roots"""

    bl_idname = "vellus.make_uv_map"
    bl_label = "Make UV Map"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select a mesh, or hair on one, in Object Mode.")
        return context.mode == "OBJECT" and surface_of(context.object) is not None

    def change(self, context):
        systems.make_uv_map(surface_of(context.object), context.view_layer)
