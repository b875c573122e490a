# SPDX-License-Identifier: GPL-3.0-or-later
"""A saved look → the active hair's appearance."""

import bpy

from ....groom.selection import hair_of
from ....materials import looks
from ....settings import properties, saved_looks
from ..base.hair_operator import HairOperator, needs_hair


class VELLUS_OT_apply_saved_look(HairOperator, bpy.types.Operator):
    """Apply a saved look to the active hair"""

    bl_idname = "vellus.apply_saved_look"
    bl_label = "Apply Saved Look"
    __annotations__ = {"name": properties.text("Name", "Saved look")}
    applies = needs_hair

    def change(self, context):
        looks.apply_look(hair_of(context.object), saved_looks.read(self.name))
