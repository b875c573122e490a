# SPDX-License-Identifier: GPL-3.0-or-later
"""A named look → the active hair's appearance."""

import bpy

from .....core.shading.presets import PRESETS
from ....groom.selection import hair_of
from ....materials import looks
from ....settings import properties
from ..base.hair_operator import HairOperator, needs_hair


class VELLUS_OT_apply_preset(HairOperator, bpy.types.Operator):
    """Apply a built-in look to the active hair"""

    bl_idname = "vellus.apply_preset"
    bl_label = "Apply Look"
    __annotations__ = {
        "preset": properties.choice(
            "Look", "Look to apply", {identifier: label for identifier, (label, _look) in PRESETS.items()}
        )
    }
    applies = needs_hair

    def change(self, context):
        label, look = PRESETS[self.preset]
        looks.apply_look(hair_of(context.object), look)
        return label, {}
