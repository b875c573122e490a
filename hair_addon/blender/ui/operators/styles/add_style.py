# SPDX-License-Identifier: GPL-3.0-or-later
"""A kind of the menu → a style of the active hair."""

import bpy

from .....core.styling.kinds import DESCRIPTIONS, OFFERS
from ....groom.selection import hair_of
from ....groom.styles import hair_styles
from ....settings import properties
from ..base.hair_operator import HairOperator, needs_hair
from .base import fit_switch


class VELLUS_OT_add_style(HairOperator, bpy.types.Operator):
    """Add a style to the active hair, after its other styles"""

    bl_idname = "vellus.add_style"
    bl_label = "Add Style"
    __annotations__ = {
        "style": properties.choice(
            "Style",
            "Style to add",
            {identifier: offer.label for identifier, offer in OFFERS.items()},
            {identifier: DESCRIPTIONS[offer.kind] for identifier, offer in OFFERS.items()},
        ),
        "is_fitted": fit_switch(),
    }
    applies = needs_hair

    def change(self, context):
        offer = OFFERS[self.style]
        hair_styles.add(hair_of(context.object), offer.settings, offer.label, self.is_fitted)
