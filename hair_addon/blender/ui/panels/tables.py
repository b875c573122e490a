# SPDX-License-Identifier: GPL-3.0-or-later
"""Lookup Tables panel."""

import bpy

from ....core.shading import appearance
from ....core.shading.tables import lookup_tables
from ...groom.selection import hair_of
from ..setting_rows import others, row, rows
from .tab import HairTab, split

# Classic mode only.
_GLINTS = ("caustic", "glint_gain", "glint_width", "glint_fade", "glint_limit", "eccentricity")


class VELLUS_PT_tables(HairTab, bpy.types.Panel):
    """Lookup tables of the Marschner model"""

    bl_label = "Advanced: Lookup Tables"
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
        row(layout, state, "table_folder")
        layout.operator("vellus.bake_tables", icon="RENDER_STILL")


CLASSES = (VELLUS_PT_tables,)
