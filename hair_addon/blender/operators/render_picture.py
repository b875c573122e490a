# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's hair and meshes, seen by its camera → a picture file, with the viewport's drawing code."""

import bpy

from ...core.long_work import Stage
from .. import files, properties, render
from .file_browser import BrowsedOperator


class VELLUS_OT_render_picture(BrowsedOperator, bpy.types.Operator):
    """Draw the hair as the viewport shades it, from the scene's camera, into a file"""

    bl_idname = "vellus.render_picture"
    bl_label = "Render Picture"
    bl_options = {"REGISTER"}
    __annotations__ = {
        "filepath": properties.file("File that the picture is written to, .png or .exr"),
        **properties.annotations(render.PictureSettings),
    }
    asked = "filepath"

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("The scene has no camera to look through: add one.")
        return context.scene.camera is not None

    def seconds(self, context):
        return float("inf")  # graphics drivers differ a hundredfold

    def work(self, context):
        settings = properties.to_settings(self, render.PictureSettings)
        path = files.resolve(self.filepath)
        pixels = yield from render.drawing_picture(settings)
        yield Stage("Writing the picture", 0.95)
        render.write_picture(pixels, path, bpy.context.scene)
        return path

    def message(self, made):
        return "Picture written to {path}", {"path": made}
