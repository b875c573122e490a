# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and a mesh → hair attached to it."""

import bpy

from ....groom import attached_hair
from ....groom.selection import mesh_to_attach_to, parts_of
from ....live import reported
from ..base.hair_operator import HairOperator


class VELLUS_OT_attach_to_surface(HairOperator, bpy.types.Operator):
    """Attach the active hair and its guides to their surface, or to the selected mesh"""

    bl_idname = "vellus.attach_to_surface"
    bl_label = "Attach to Surface"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("In Object Mode, select hair or guides and a mesh.")
        return context.mode == "OBJECT" and mesh_to_attach_to(context) is not None

    def change(self, context):
        parts, depsgraph = parts_of(context.object), context.evaluated_depsgraph_get()
        attached_hair.attach(parts, mesh_to_attach_to(context), depsgraph, reported.place_before)
