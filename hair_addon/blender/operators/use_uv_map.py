# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair whose UV map was renamed or removed → hair that knows the active one."""

import bpy

from .. import systems
from ..selection import surface_of
from .base import HairOperator


class VELLUS_OT_use_uv_map(HairOperator, bpy.types.Operator):
    """Tell all hair on the surface its roots' places in the UV map that is active"""

    bl_idname = "vellus.use_uv_map"
    bl_label = "Use Active UV Map"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select a mesh with hair, or hair on one.")
        return surface_of(context.object) is not None

    def change(self, context):
        systems.renew_uvs(surface_of(context.object), context.evaluated_depsgraph_get())
