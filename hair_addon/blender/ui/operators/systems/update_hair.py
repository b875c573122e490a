# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and hair without Auto Update → as their settings and inputs are now."""

import bpy

from ....groom.selection import parts_of
from ....live.update_once import update_once
from ..base.hair_operator import HairOperator


class VELLUS_OT_update_hair(HairOperator, bpy.types.Operator):
    """Update the active hair and its guides, which are not updated automatically"""

    bl_idname = "vellus.update_hair"
    bl_label = "Update Now"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair or guides whose Auto Update is off, in Object Mode.")
        return context.mode == "OBJECT" and not all(part.vellus.is_live for part in parts_of(context.object))

    def change(self, context):
        update_once(parts_of(context.object), context.view_layer)
