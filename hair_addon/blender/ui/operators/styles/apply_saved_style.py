# SPDX-License-Identifier: GPL-3.0-or-later
"""A saved style preset → the active hair."""

import bpy

from ....groom.selection import hair_of
from ....groom.styles import hair_styles
from ....settings import properties, saved_styles
from ..base.hair_operator import HairOperator, needs_hair
from .base import keep_switch


class VELLUS_OT_apply_saved_style(HairOperator, bpy.types.Operator):
    """Give the active hair the styles of a saved preset"""

    bl_idname = "vellus.apply_saved_style"
    bl_label = "Apply Saved Style"
    __annotations__ = {
        "name": properties.text("Name", "Saved style preset"),
        "is_fitted": properties.switch(
            "Fit to Surface", "Multiply lengths by the size of the surface, as if saved from a human head", False
        ),
        "keeps_styles": keep_switch(),
    }
    applies = needs_hair

    def change(self, context):
        preset = saved_styles.read(self.name)
        hair_styles.apply_preset(hair_of(context.object), preset, self.is_fitted, self.keeps_styles)
