# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators for drawing hair: engine, tables, pictures."""

import bpy

from ....core.grooming import cost
from ....core.imaging.pixel_sampling import FRAME_FIELDS, MOST_DRAWN, PictureSettings
from ....core.long_work import Stage
from ....core.shading.tables import lookup_tables
from ... import io
from ...data.pictures import picture_jobs
from ...groom.selection import drawn_with, hair_of
from ...host import paths
from ...host.datablocks import Remembered
from ...materials import looks
from ...render import offscreen
from ...render.frames import composite
from ...settings import properties, setting_properties
from .base.file_browser import BrowsedOperator
from .base.hair_operator import HairOperator


class VELLUS_OT_toggle_drawing(HairOperator, bpy.types.Operator):
    """Draw the active hair with its shading model or as Blender's curves; without active hair, all hair in the file"""

    bl_idname = "vellus.toggle_drawing"
    bl_label = "Toggle Hair Shading"

    @classmethod
    def applies(cls, context):
        cls.poll_message_set("There is no hair in this file.")
        return bool(drawn_with(context.object))

    def change(self, context):
        hair = drawn_with(context.object)
        looks.show_shaded(hair, not all(datablock.vellus.is_drawn for datablock in hair))


class VELLUS_OT_bake_tables(BrowsedOperator, bpy.types.Operator):
    """Bake the active hair's Marschner lookup tables to a folder and use them while the settings match"""

    bl_idname = "vellus.bake_tables"
    bl_label = "Bake Lookup Tables"
    __annotations__ = {
        "directory": properties.folder("Folder to write the lookup tables to"),
        **setting_properties.annotations(lookup_tables.Settings),
    }
    asked = "directory"

    @classmethod
    def applies(cls, _context):
        return True  # also without hair

    def prefill(self, context):
        """Fill unset properties with the settings of the hair, if there is one."""
        hair = hair_of(context.object)
        if hair is None:
            return
        settings = properties.table_settings_of(hair.vellus)
        for name in setting_properties.names_of(lookup_tables.Settings):
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))

    def seconds(self, context):
        return cost.table_seconds(self.size)

    def work(self, context):
        hair = Remembered(hair_of(context.object))
        settings = setting_properties.to_settings(self, lookup_tables.Settings)
        folder, named = paths.resolve(self.directory), self.directory
        yield from io.table_files.baking_tables(settings, folder)
        target = hair.find()
        if target is not None:
            target.vellus.table_folder = named
        return folder

    def message(self, made):
        return "Lookup tables written to {folder}", {"folder": made}


class VELLUS_OT_render_picture(BrowsedOperator, bpy.types.Operator):
    """Draw the scene's hair and meshes from its camera to a file"""

    bl_idname = "vellus.render_picture"
    bl_label = "Render Picture"
    bl_options = {"REGISTER"}
    __annotations__ = {
        "filepath": properties.file("Image file to write, .png or .exr"),
        **setting_properties.annotations(
            PictureSettings, skip=FRAME_FIELDS, high={"width": MOST_DRAWN, "height": MOST_DRAWN}
        ),
    }
    asked = "filepath"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("The scene has no camera: add one.")
        return context.scene.camera is not None

    def seconds(self, context):
        return float("inf")  # graphics drivers differ a hundredfold

    def work(self, context):
        settings = setting_properties.to_settings(self, PictureSettings, skip=FRAME_FIELDS)
        path = paths.resolve(self.filepath)
        pixels = yield from offscreen.drawing_picture(settings)
        yield Stage("Writing the picture", 0.95)
        offscreen.write_picture(pixels, path, bpy.context.scene)
        return path

    def message(self, made):
        return "Picture written to {path}", {"path": made}


class VELLUS_OT_toggle_composite(HairOperator, bpy.types.Operator):
    """Render surfaces with Cycles or EEVEE and hair with Vellus into one picture; press again to undo this"""

    bl_idname = "vellus.toggle_composite"
    bl_label = "Composite Hair"

    def change(self, context):
        is_on = composite.is_on(context.scene)
        (composite.turn_off if is_on else composite.turn_on)(context.scene)


class VELLUS_OT_retry_baking(HairOperator, bpy.types.Operator):
    """Repeat the renders and bakes of Cycles that failed"""

    bl_idname = "vellus.retry_baking"
    bl_label = "Try Again"
    bl_options = {"REGISTER"}  # no data changes

    @classmethod
    def applies(cls, _context):
        cls.poll_message_set("No render or bake of Cycles has failed.")
        return picture_jobs.has_failed()

    def change(self, _context):
        picture_jobs.try_again()


CLASSES = (
    VELLUS_OT_toggle_drawing,
    VELLUS_OT_bake_tables,
    VELLUS_OT_render_picture,
    VELLUS_OT_toggle_composite,
    VELLUS_OT_retry_baking,
)
