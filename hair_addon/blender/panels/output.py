# SPDX-License-Identifier: GPL-3.0-or-later
"""Output: pictures of the hair."""

import bpy

from .tab import HairTab


class VELLUS_PT_output(HairTab, bpy.types.Panel):
    """Pictures of the hair"""

    bl_label = "Output"
    bl_idname = "VELLUS_PT_output"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.operator("vellus.render_picture", icon="IMAGE_DATA")
        layout.operator("vellus.toggle_drawing", icon="SHADING_RENDERED")


CLASSES = (VELLUS_PT_output,)
