# SPDX-License-Identifier: GPL-3.0-or-later
"""A look that the artist saved → gone."""

import bpy

from .. import properties, saved_looks
from .base import HairOperator


class VELLUS_OT_remove_look(HairOperator, bpy.types.Operator):
    """Remove a saved look for good"""

    bl_idname = "vellus.remove_look"
    bl_label = "Remove Look"
    bl_options = {"REGISTER", "INTERNAL"}
    __annotations__ = {"name": properties.text("Name", "The saved look")}

    def change(self, _context):
        saved_looks.remove(self.name)
