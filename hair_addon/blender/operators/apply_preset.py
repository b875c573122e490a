# SPDX-License-Identifier: GPL-3.0-or-later
"""A named look → the active hair's appearance."""

import bpy

from ...core.shading.presets import PRESETS
from .. import looks, properties
from ..selection import hair_of
from .base import HairOperator


class VELLUS_OT_apply_preset(HairOperator, bpy.types.Operator):
    """Make the active hair look like natural, dyed or wet hair"""

    bl_idname = "vellus.apply_preset"
    bl_label = "Apply Preset"
    __annotations__ = {
        "preset": properties.choice(
            "Preset", "The look to begin with", {identifier: label for identifier, (label, _look) in PRESETS.items()}
        )
    }

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Select hair.")
        return hair_of(context.object) is not None

    def change(self, context):
        label, look = PRESETS[self.preset]
        looks.apply_look(hair_of(context.object), look)
        return label, {}
