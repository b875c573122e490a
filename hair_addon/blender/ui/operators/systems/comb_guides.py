# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt mode on the guides of a mesh or hair."""

import bpy

from .....core.errors import HairError, cause_of
from ....data.strands.curves import require_editable
from ....groom.guides import brushes
from ....groom.selection import guides_of, make_active, object_of, reveal
from ..base.hair_operator import HairOperator


class VELLUS_OT_comb_guides(HairOperator, bpy.types.Operator):
    """Select the guides of the active mesh or hair and sculpt them with Blender's brushes"""

    bl_idname = "vellus.comb_guides"
    bl_label = "Comb Guides"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select a mesh with guides, or hair that follows guides, in Object Mode.")
        return context.mode == "OBJECT" and guides_of(context.object) is not None

    def change(self, context):
        curves, view_layer = guides_of(context.object), context.view_layer
        require_editable(curves)
        guides = object_of(curves, view_layer)
        if guides is None and any(o.data == curves for o in bpy.data.objects):
            sentence = '"{name}" is not in this view layer: include one of its collections.'
            raise HairError(sentence, name=curves.name)
        if guides is None:
            raise HairError("The guides have no object in this view layer: restore the guides.")
        viewport = context.space_data if context.area is not None and context.area.type == "VIEW_3D" else None
        reveal(guides, view_layer, viewport)
        make_active(guides, view_layer)
        try:
            bpy.ops.object.mode_set(mode="SCULPT_CURVES")
        except RuntimeError as error:  # hidden by a library or a driver
            sentence = '"{name}" cannot be combed: {cause}.'
            raise HairError(sentence, name=guides.name, cause=cause_of(error)) from error
        brushes.collide(guides.data)
        brushes.fit(guides.data, context.tool_settings.curves_sculpt)
