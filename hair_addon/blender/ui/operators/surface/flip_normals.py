# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh that is inside out → the same with normals that point outward."""

import bpy

from ....groom import edits
from ....groom.selection import surface_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_flip_normals(HairOperator, bpy.types.Operator):
    """Flip the normals of the surface's faces. Guides that were not combed grow again, on the other side"""

    bl_idname = "vellus.flip_normals"
    bl_label = "Flip Normals"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh, or hair on one, in Object Mode.")
        return context.mode == "OBJECT" and surface_of(context.object) is not None

    def change(self, context):
        edits.flip_normals(surface_of(context.object), context.view_layer)
