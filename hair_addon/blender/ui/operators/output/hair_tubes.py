# SPDX-License-Identifier: GPL-3.0-or-later
"""The hair of the active object → a mesh of tubes."""

import bpy

from .....core.cards.card_settings import TubeSettings
from ....groom.selection import hair_of
from ....io import hair_meshes
from ....settings import setting_properties
from ....settings.translations import error_text, interface_text
from ... import setting_rows
from ..base.asked import AskedOperator
from ..base.hair_operator import needs_hair


class VELLUS_OT_hair_tubes(AskedOperator, bpy.types.Operator):
    """Make a mesh in which each strand is a closed tube; the hair stays"""

    bl_idname = "vellus.hair_tubes"
    bl_label = "Hair Tubes"
    __annotations__ = setting_properties.annotations(TubeSettings)
    applies = needs_hair

    def draw(self, context):
        setting_rows.all_rows(self.layout, self.properties, TubeSettings)
        settings = setting_properties.to_settings(self.properties, TubeSettings)
        strands = hair_meshes.strand_count(hair_of(context.object))
        counts = {"tubes": settings.count_of(strands), "triangles": settings.triangle_count(strands)}
        text = interface_text("{tubes:,} tubes, {triangles:,} triangles", **counts)
        self.layout.label(text=text, translate=False)

    def seconds(self, context):
        strands = hair_meshes.strand_count(hair_of(context.object))
        return 5e-6 * self._settings().triangle_count(strands)

    def work(self, context):
        return hair_meshes.making_tubes(hair_of(context.object), self._settings())

    def after(self, context, made):
        for note in made.notes:
            self.report({"WARNING"}, error_text(note))

    def message(self, made):
        counts = {"tubes": made.tube_count, "triangles": made.triangle_count}
        return "{tubes:,} tubes, {triangles:,} triangles", counts

    def _settings(self):
        return setting_properties.to_settings(self, TubeSettings)
