# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables: what the Marschner model reads."""

import bpy

from ...core.shading import appearance, lookup_tables
from ..selection import hair_of
from .tab import HairTab, others, rows, split

# The classic mode's alone.
_GLINTS = ("caustic", "glint_gain", "glint_width", "glint_fade", "glint_limit", "eccentricity")


class VELLUS_PT_tables(HairTab, bpy.types.Panel):
    """The Marschner model's tables"""

    bl_label = "Tables"
    bl_idname = "VELLUS_PT_tables"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        hair = hair_of(context.object)
        return hair is not None and hair.vellus.model == "MARSCHNER"

    def draw(self, context):
        layout = split(self.layout)
        state = hair_of(context.object).vellus
        hidden = _GLINTS if state.appearance.mode == "energy" else ()
        settings = lookup_tables.Settings
        rows(layout, state.marschner, settings, others(settings, appearance.TABLE_FIELDS, hidden))
        layout.prop(state, "table_folder")
        layout.operator("vellus.bake_tables", icon="RENDER_STILL")


CLASSES = (VELLUS_PT_tables,)
