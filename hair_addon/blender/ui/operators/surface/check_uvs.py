# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface's UV map → the share of its area with overlapping or missing UVs."""

import bpy

from ....groom import edits
from ....groom.selection import surface_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_check_uvs(HairOperator, bpy.types.Operator):
    """Check the surface's UV map for overlaps, where hair nodes misplace strands"""

    bl_idname = "vellus.check_uvs"
    bl_label = "Check UVs"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh, or hair on one.")
        return surface_of(context.object) is not None

    def change(self, context):
        share = edits.check_uvs(surface_of(context.object), context.evaluated_depsgraph_get())
        return "{percent:.1f}% of the surface has overlapping or missing UVs", {"percent": 100.0 * share}
