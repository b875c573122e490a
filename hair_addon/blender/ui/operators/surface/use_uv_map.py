# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair whose UV map was renamed or removed → root coordinates of the active one."""

import bpy

from ....groom import edits
from ....groom.selection import surface_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_use_uv_map(HairOperator, bpy.types.Operator):
    """Update the root coordinates of all hair on the surface from the active UV map"""

    bl_idname = "vellus.use_uv_map"
    bl_label = "Use Active UV Map"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh with hair, or hair on one.")
        return surface_of(context.object) is not None

    def change(self, context):
        edits.renew_uvs(surface_of(context.object), context.evaluated_depsgraph_get())
