# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that write files and create meshes from a groom: exports, settings, cards, tubes."""

import bpy

from ....core.cards.card_settings import CardSettings, TubeSettings
from ....core.errors import HairError
from ....core.files import settings_file
from ....core.files.export_settings import ENDINGS, ExportSettings
from ....core.long_work import Stage
from ... import io
from ...groom.selection import hair_of, make_active, object_of
from ...groom.transfer import groom_settings
from ...host import paths
from ...host.notices import text_of
from ...settings import properties, setting_properties
from ...settings.translations import error_text, interface_text
from .. import setting_rows
from .base.dialog import DialogOperator
from .base.file_browser import BrowsedOperator
from .base.hair_operator import needs_hair


class VELLUS_OT_save_groom_settings(BrowsedOperator, bpy.types.Operator):
    """Save the settings of the active hair and its guides to a file, for other hair, scripts, and the command line"""

    bl_idname = "vellus.save_groom_settings"
    bl_label = "Save Groom Settings"
    bl_options = {"REGISTER"}
    __annotations__ = {
        "filepath": properties.file("Settings file to write, .json"),
        "filter_glob": properties.only_files("*.json"),
    }
    asked = "filepath"
    applies = needs_hair

    def seconds(self, context):
        return 0.0

    def work(self, context):
        path = paths.resolve(self.filepath)
        path = path if path.suffix else path.with_suffix(".json")
        hair = hair_of(context.object)
        if hair is None:
            raise HairError("Select hair.")
        settings = groom_settings.settings_of(hair)
        yield Stage("Writing settings", 0.5)
        settings_file.write(path, settings)
        return path

    def message(self, made):
        return "Settings written to {path}", {"path": made}


class VELLUS_OT_load_groom_settings(BrowsedOperator, bpy.types.Operator):
    """Apply the settings of a file to the active hair and its guides; on a mesh without hair, create a hair system"""

    bl_idname = "vellus.load_groom_settings"
    bl_label = "Load Groom Settings"
    __annotations__ = {
        "filepath": properties.file("Groom settings file, .json"),
        "filter_glob": properties.only_files("*.json"),
    }
    asked = "filepath"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("Select hair, or a mesh to grow hair on.")
        active = context.object
        return active is not None and (active.type == "MESH" or hair_of(active) is not None)

    def seconds(self, context):
        return float("inf")  # the counts are in the file

    def work(self, context):
        settings = settings_file.read(paths.resolve(self.filepath))
        hair = hair_of(context.object)
        if hair is None:
            depsgraph = context.evaluated_depsgraph_get()
            _guides, hair = yield from groom_settings.adding_hair(context.object, settings, depsgraph)
            return hair
        groom_settings.apply_settings(hair, settings)
        yield Stage("Applying settings", 1.0)
        return hair

    def message(self, made):
        return "Settings applied to {name}", {"name": made.name}

    def after(self, context, made):
        context.view_layer.update()  # regenerates strands, and evaluates new objects
        make_active(object_of(made, context.view_layer), context.view_layer)


class VELLUS_OT_export_groom(BrowsedOperator, bpy.types.Operator):
    """Write the hair on the active mesh and its guides to a file: Alembic for Unreal, USD, or strands"""

    bl_idname = "vellus.export_groom"
    bl_label = "Export Groom"
    bl_options = {"REGISTER"}
    __annotations__ = {
        "filepath": properties.file("File to write, .abc, .usd, .usdc, .usda, .hair, .data, .ply or .npz"),
        "filter_glob": properties.only_files(";".join(f"*{ending}" for ending in ENDINGS)),
        **setting_properties.annotations(ExportSettings),
    }
    asked = "filepath"
    applies = needs_hair

    def seconds(self, context):
        return float("inf")  # the duration of an animation is unknown

    def work(self, context):
        path = paths.resolve(self.filepath)
        path = path if path.suffix else path.with_suffix(".abc")
        settings = setting_properties.to_settings(self, ExportSettings)
        return io.groom_export.exporting(path, io.groom_sources.hair_on(context.object), settings, context.scene)

    def after(self, context, made):
        for note in made.notes:
            self.report({"WARNING"}, error_text(note))

    def message(self, made):
        counts = {"guide_count": made.guides, "strand_count": made.strands, "path": made.path}
        return "{guide_count} guides and {strand_count} strands written to {path}", counts


class VELLUS_OT_hair_cards(DialogOperator, bpy.types.Operator):
    """Create ribbons that replace clumps of strands, with textures of the strands; the hair itself is kept"""

    bl_idname = "vellus.hair_cards"
    bl_label = "Hair Cards"
    __annotations__ = {
        **setting_properties.annotations(CardSettings),
        "folder": properties.folder("Folder for the textures. Leave empty to pack them into the .blend file"),
    }
    applies = needs_hair

    def draw(self, context):
        setting_rows.mesh_rows(self.layout, self.properties, CardSettings)
        setting_rows.row(self.layout, self.properties, "folder")
        settings = setting_properties.to_settings(self.properties, CardSettings)
        for index, level in enumerate(settings.levels(io.hair_meshes.strand_count(hair_of(context.object)))):
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
        return io.hair_cards.making_cards(hair_of(context.object), settings, place)

    def after(self, context, made):
        for note in made[0].notes:
            self.report({"WARNING"}, error_text(note))

    def message(self, made):
        counts = {"cards": made[0].card_count, "pictures": made[0].picture_count, "triangles": made[0].triangle_count}
        error = made[0].error
        if error is None:
            return "{cards} cards with {pictures} pictures, {triangles:,} triangles", counts
        errors = {"coverage": error.coverage, "flip": error.flip}
        text = "{cards} cards, {triangles:,} triangles; errors: coverage {coverage:.3f}, FLIP {flip:.3f}"
        return text, counts | errors


class VELLUS_OT_hair_tubes(DialogOperator, bpy.types.Operator):
    """Create a mesh with a closed tube for each strand; the hair itself is kept"""

    bl_idname = "vellus.hair_tubes"
    bl_label = "Hair Tubes"
    __annotations__ = setting_properties.annotations(TubeSettings)
    applies = needs_hair

    def draw(self, context):
        setting_rows.mesh_rows(self.layout, self.properties, TubeSettings)
        settings = setting_properties.to_settings(self.properties, TubeSettings)
        strands = io.hair_meshes.strand_count(hair_of(context.object))
        counts = {"tubes": settings.count_of(strands), "triangles": settings.triangle_count(strands)}
        text = interface_text("{tubes:,} tubes, {triangles:,} triangles", **counts)
        self.layout.label(text=text, translate=False)

    def seconds(self, context):
        strands = io.hair_meshes.strand_count(hair_of(context.object))
        return 5e-6 * self._settings().triangle_count(strands)

    def work(self, context):
        return io.hair_meshes.making_tubes(hair_of(context.object), self._settings())

    def after(self, context, made):
        for note in made.notes:
            self.report({"WARNING"}, error_text(note))

    def message(self, made):
        counts = {"tubes": made.tube_count, "triangles": made.triangle_count}
        return "{tubes:,} tubes, {triangles:,} triangles", counts

    def _settings(self):
        return setting_properties.to_settings(self, TubeSettings)


CLASSES = (
    VELLUS_OT_save_groom_settings,
    VELLUS_OT_load_groom_settings,
    VELLUS_OT_export_groom,
    VELLUS_OT_hair_cards,
    VELLUS_OT_hair_tubes,
)
