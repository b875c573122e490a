# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's hair and meshes, seen by its camera → a picture file, with the viewport's drawing code."""

import bpy

from .. import files, properties, render
from .base import HairOperator


class VELLUS_OT_render_picture(HairOperator, bpy.types.Operator):
    """Draw the hair as the viewport shades it, from the scene's camera, into a file"""

    bl_idname = "vellus.render_picture"
    bl_label = "Render Picture"
    bl_options = {"REGISTER"}
    __annotations__ = {
        "filepath": properties.file("File that the picture is written to, .png or .exr"),
        **properties.annotations(render.PictureSettings),
    }

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("The scene has no camera to look through: add one.")
        return context.scene.camera is not None

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def change(self, context):
        settings = properties.to_settings(self, render.PictureSettings)
        path = files.resolve(self.filepath)
        depsgraph = context.evaluated_depsgraph_get()
        pixels = render.draw_picture(context.scene, context.view_layer, depsgraph, settings)
        render.write_picture(pixels, path, context.scene)
        return "Picture written to {path}", {"path": path}
