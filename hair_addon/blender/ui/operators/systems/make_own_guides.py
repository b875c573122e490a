# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that shares its guides → hair with guides of its own."""

import bpy

from ....groom import copied_hair
from ....groom.selection import active_of_kind, parts_of
from ..base.hair_operator import HairOperator


class VELLUS_OT_make_own_guides(HairOperator, bpy.types.Operator):
    """Give the active hair a copy of its guides on its surface, so that combing them changes no other hair"""

    bl_idname = "vellus.make_own_guides"
    bl_label = "Make Own Guides"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair that shares its guides, in Object Mode.")
        return context.mode == "OBJECT" and bool(_sharing(context))

    def change(self, context):
        made = copied_hair.make_own_guides(_sharing(context), context.evaluated_depsgraph_get())
        return "{count} guides", {"count": sum(len(guides.curves) for guides in made)}


def _sharing(context):
    """The active hair, if other hair follows its guides; or the hair with guides on another surface than its own."""
    hair = active_of_kind(context.object, "HAIR")
    if hair is not None:
        return [hair] if copied_hair.sharing(hair) or copied_hair.are_elsewhere(hair) else []
    return [part for part in parts_of(context.object) if part.vellus.kind == "HAIR" and copied_hair.are_elsewhere(part)]
