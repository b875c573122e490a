# SPDX-License-Identifier: GPL-3.0-or-later
"""The hair of the active object → cards with textures, for games."""

import bpy

from .....core.cards.card_settings import CardSettings
from ....groom.selection import hair_of
from ....host import paths
from ....host.notices import text_of
from ....io import hair_cards, hair_meshes
from ....settings import properties, setting_properties
from ....settings.translations import error_text, interface_text
from ... import setting_rows
from ..base.asked import AskedOperator
from ..base.hair_operator import needs_hair


class VELLUS_OT_hair_cards(AskedOperator, bpy.types.Operator):
    """Make ribbons in place of clumps of strands, with textures drawn of the strands; the hair stays"""

    bl_idname = "vellus.hair_cards"
    bl_label = "Hair Cards"
    __annotations__ = {
        **setting_properties.annotations(CardSettings),
        "folder": properties.folder("Folder for the textures. Leave empty to pack them into the .blend file"),
    }
    applies = needs_hair

    def draw(self, context):
        setting_rows.all_rows(self.layout, self.properties, CardSettings)
        setting_rows.row(self.layout, self.properties, "folder")
        settings = setting_properties.to_settings(self.properties, CardSettings)
        for index, level in enumerate(settings.levels(hair_meshes.strand_count(hair_of(context.object)))):
            counts = {"cards": level.card_count, "triangles": level.triangle_count, "size": level.texture_size}
            text = interface_text(
                "Level {level}: {cards} cards, {triangles:,} triangles, {size} px", level=index, **counts
            )
            self.layout.label(text=text, translate=False)

    def seconds(self, context):
        return float("inf")  # graphics drivers differ a hundredfold

    def work(self, context):
        folder = text_of(self, "folder")
        place = paths.resolve(folder) if folder else None
        settings = setting_properties.to_settings(self, CardSettings)
        return hair_cards.making_cards(hair_of(context.object), settings, place)

    def after(self, context, made):
        for note in made[0].notes:
            self.report({"WARNING"}, error_text(note))

    def message(self, made):
        counts = {"cards": made[0].card_count, "pictures": made[0].picture_count, "triangles": made[0].triangle_count}
        return "{cards} cards with {pictures} pictures, {triangles:,} triangles", counts
