# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface: what hair grows on, what is amiss with it, and what is done with hair as a whole."""

import bpy

from ..selection import active_of_kind, parts_of, surface_of
from ..surface_checks import warnings_of
from ..translations import interface_text
from .tab import HairTab, draw_progress, split, write


class VELLUS_PT_surface(HairTab, bpy.types.Panel):
    """The mesh that hair grows on"""

    bl_label = "Surface"
    bl_idname = "VELLUS_PT_surface"

    def draw(self, context):
        layout = split(self.layout)
        if draw_progress(layout):
            return
        surface, parts = surface_of(context.object), parts_of(context.object)
        active = active_of_kind(context.object, "HAIR") or active_of_kind(context.object, "GUIDES")
        if active is not None:
            layout.prop(active, "surface")
        elif surface is not None:
            layout.label(text=surface.name, icon="MESH_DATA", translate=False)
        else:
            write(layout, context, interface_text("Select a mesh to grow hair on."), "INFO")
            return
        for warning in warnings_of(surface, parts):
            box = layout.box()
            write(box, context, warning.text, "ERROR")
            if warning.operator:
                box.operator(warning.operator)
        if active is None:
            layout.operator("vellus.add_hair", icon="OUTLINER_OB_CURVES")
        if parts:
            _draw_tools(layout)


def _draw_tools(layout):
    column = layout.column(align=True)
    column.operator("vellus.comb_guides", icon="SCULPTMODE_HLT")
    row = column.row(align=True)
    row.operator("vellus.select_guides", text="Guides", icon="RESTRICT_SELECT_OFF")
    row.operator("vellus.select_hair", text="Hair", icon="RESTRICT_SELECT_OFF")
    column.operator("vellus.delete_hair", icon="TRASH")


class VELLUS_PT_surface_uvs(HairTab, bpy.types.Panel):
    """By which hair nodes find roots on a surface that moves"""

    bl_label = "UV Map"
    bl_idname = "VELLUS_PT_surface_uvs"
    bl_parent_id = "VELLUS_PT_surface"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return surface_of(context.object) is not None

    def draw(self, context):
        layout = self.layout
        used = sorted({part.surface_uv_map for part in parts_of(context.object) if part.surface_uv_map})
        if used:
            layout.label(text=", ".join(used), icon="GROUP_UVS", translate=False)
        column = layout.column(align=True)
        column.operator("vellus.check_uvs", icon="VIEWZOOM")
        column.operator("vellus.use_uv_map", icon="FILE_REFRESH")
        column.operator("vellus.make_uv_map", icon="UV")


CLASSES = (VELLUS_PT_surface, VELLUS_PT_surface_uvs)
