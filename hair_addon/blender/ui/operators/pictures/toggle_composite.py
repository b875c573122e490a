# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures by Cycles or EEVEE with their own hair ↔ with hair by Vellus."""

import bpy

from ....render.frames import composite
from ..base.hair_operator import HairOperator


class VELLUS_OT_toggle_composite(HairOperator, bpy.types.Operator):
    """Render surfaces by Cycles or EEVEE and hair by Vellus into one picture, by the compositor; again to undo this"""

    bl_idname = "vellus.toggle_composite"
    bl_label = "Composite Hair"

    def change(self, context):
        is_on = composite.is_on(context.scene)
        (composite.turn_off if is_on else composite.turn_on)(context.scene)
