# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface's UV map → how much of it leads astray."""

import bpy

from .. import systems
from ..selection import surface_of
from .base import HairOperator


class VELLUS_OT_check_uvs(HairOperator, bpy.types.Operator):
    """Look for overlaps in the surface's UV map, which lead hair nodes to the wrong place"""

    bl_idname = "vellus.check_uvs"
    bl_label = "Check UVs"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select a mesh, or hair on one.")
        return surface_of(context.object) is not None

    def change(self, context):
        share = systems.check_uvs(surface_of(context.object), context.evaluated_depsgraph_get())
        return "{percent:.1f} % of the surface cannot be found by its UVs", {"percent": 100.0 * share}
