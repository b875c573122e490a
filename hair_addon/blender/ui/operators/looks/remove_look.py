# SPDX-License-Identifier: GPL-3.0-or-later
"""Delete a saved look."""

import bpy

from ....settings import properties, saved_looks
from ..base.hair_operator import HairOperator


class VELLUS_OT_remove_look(HairOperator, bpy.types.Operator):
    """Delete a saved look permanently"""

    bl_idname = "vellus.remove_look"
    bl_label = "Remove Look"
    bl_options = {"REGISTER", "INTERNAL"}
    __annotations__ = {"name": properties.text("Name", "Saved look")}

    def change(self, _context):
        saved_looks.remove(self.name)
