# SPDX-License-Identifier: GPL-3.0-or-later
"""A built-in style preset → the active hair."""

import bpy

from .....core.files import style_presets
from ....groom.selection import hair_of
from ....groom.styles import hair_styles
from ....settings import properties
from ..base.hair_operator import HairOperator, needs_hair
from .base import fit_switch, keep_switch


class VELLUS_OT_apply_style_preset(HairOperator, bpy.types.Operator):
    """Give the active hair the styles of a built-in preset"""

    bl_idname = "vellus.apply_style_preset"
    bl_label = "Apply Style Preset"
    __annotations__ = {
        "preset": properties.choice("Preset", "Preset to apply", style_presets.PRESETS),
        "is_fitted": fit_switch(),
        "keeps_styles": keep_switch(),
    }
    applies = needs_hair

    def change(self, context):
        preset = style_presets.read(self.preset)
        hair_styles.apply_preset(hair_of(context.object), preset, self.is_fitted, self.keeps_styles)
        return style_presets.PRESETS[self.preset], {}
