# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that lost its surface + a mesh → hair on it."""

import bpy

from .. import systems
from ..selection import mesh_to_attach_to, parts_of
from .base import HairOperator


class VELLUS_OT_attach_to_surface(HairOperator, bpy.types.Operator):
    """Make the active hair and its guides grow on the mesh that is picked as their surface, or selected beside them"""

    bl_idname = "vellus.attach_to_surface"
    bl_label = "Attach to Surface"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select hair or guides in Object Mode, and pick a mesh or select one too.")
        return context.mode == "OBJECT" and mesh_to_attach_to(context) is not None

    def change(self, context):
        systems.attach(parts_of(context.object), mesh_to_attach_to(context))
