# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's hair and meshes, seen by its camera → a picture file, with the viewport's drawing code."""

import bpy

from .....core.imaging.pixel_sampling import FRAME_FIELDS, MOST_DRAWN, PictureSettings
from .....core.long_work import Stage
from ....host import paths
from ....render import offscreen
from ....settings import properties, setting_properties
from ..base.file_browser import BrowsedOperator


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
