# SPDX-License-Identifier: GPL-3.0-or-later
"""A named look → the active hair's appearance."""

import bpy

from .....core.shading.presets import PRESETS
from ....groom.selection import hair_of
from ....materials import looks
from ....settings import properties
from ..base.hair_operator import HairOperator


class VELLUS_OT_apply_preset(HairOperator, bpy.types.Operator):
    """Apply a built-in look to the active hair"""

    bl_idname = "vellus.apply_preset"
    bl_label = "Apply Look"
    __annotations__ = {
        "preset": properties.choice(
            "Look", "Look to apply", {identifier: label for identifier, (label, _look) in PRESETS.items()}
        )
    }

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair.")
        return hair_of(context.object) is not None

    def change(self, context):
        label, look = PRESETS[self.preset]
        looks.apply_look(hair_of(context.object), look)
        return label, {}
