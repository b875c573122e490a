# SPDX-License-Identifier: GPL-3.0-or-later
"""Output panel: pictures, grooms for other programs and settings files."""

import bpy

from ....core.imaging.pixel_sampling import RenderSettings
from ...groom.selection import hair_of
from ...settings import animated
from ...settings.translations import interface_text
from .. import setting_rows
from .tab import HairTab, write


class VELLUS_PT_output(HairTab, bpy.types.Panel):
    """Pictures of the hair, and files of it and its settings"""

    bl_label = "Output"
    bl_idname = "VELLUS_PT_output"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.operator("vellus.render_picture", icon="IMAGE_DATA")
        layout.operator("vellus.toggle_drawing", icon="SHADING_RENDERED")
        state = context.scene.vellus
        is_on = state.hair_scene is not None
        layout.operator("vellus.toggle_composite", icon="NODE_COMPOSITING", depress=is_on)
        if is_on:
            names = ("composite_shadow", "sample_count", "multiple_scattering")
            setting_rows.rows(layout, state, RenderSettings, names)
        column = layout.column(align=True)
        column.operator("vellus.export_groom", icon="EXPORT", text="Export Groom…")
        column.operator("vellus.import_groom", icon="IMPORT", text="Import Groom…")
        column = layout.column(align=True)
        column.operator_context = "INVOKE_DEFAULT"
        column.operator("vellus.hair_cards", icon="MESH_PLANE", text="Hair Cards…")
        column.operator("vellus.hair_tubes", icon="MESH_CYLINDER", text="Hair Tubes…")
        column = layout.column(align=True)
        column.operator("vellus.save_groom_settings", icon="EXPORT", text="Save Settings…")
        column.operator("vellus.load_groom_settings", icon="IMPORT", text="Load Settings…")
        column = layout.column(align=True)
        column.operator("vellus.save_groom", icon="ASSET_MANAGER", text="Save Groom…")
        column.operator("vellus.apply_groom", icon="IMPORT", text="Apply Groom…")
        hair = hair_of(context.object)
        is_keyed = hair is not None and (animated.are_keyed(hair) or animated.keyed_ramps(hair))
        if is_keyed and not context.scene.render.use_lock_interface:
            write(
                layout,
                context,
                interface_text("Animated settings render reliably only with a locked interface."),
                "ERROR",
            )
            layout.prop(context.scene.render, "use_lock_interface")


CLASSES = (VELLUS_PT_output,)
