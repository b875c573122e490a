# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt mode on the guides of a mesh or hair."""

import bpy

from .....core.errors import HairError, cause_of
from ....data.strands.curves import followers, require_editable
from ....groom.guides import brushes
from ....groom.selection import active_of_kind, guides_of, make_active, object_of, reveal
from ..base.hair_operator import HairOperator


def is_combing(context):
    """Whether guides are in Sculpt Mode."""
    return context.mode == "SCULPT_CURVES" and active_of_kind(context.object, "GUIDES") is not None


def _stop(context):
    """Return to Object Mode, with the hair active that follows the guides, if any does."""
    guides = context.object.data
    bpy.ops.object.mode_set(mode="OBJECT")
    shown = (object_of(hair, context.view_layer) for hair in followers(guides))
    hair_object = next((o for o in shown if o is not None and o.visible_get()), None)
    if hair_object is not None:
        make_active(hair_object, context.view_layer)


class VELLUS_OT_comb_guides(HairOperator, bpy.types.Operator):
    """Select the guides of the active mesh or hair and sculpt them with Blender's brushes; or stop combing"""

    bl_idname = "vellus.comb_guides"
    bl_label = "Comb Guides"

    @classmethod
    def applies(cls, context):
        if is_combing(context):
            return True
        cls.poll_message_set("Select a mesh with guides, or hair that follows guides, in Object Mode.")
        return context.mode == "OBJECT" and guides_of(context.object) is not None

    def change(self, context):
        if is_combing(context):
            _stop(context)
            return
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
