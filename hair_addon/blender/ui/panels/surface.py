# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface panel: the mesh, problems with it, and operators for the hair on it."""

import bpy

from ...groom.foreign import foreign_meshes, particle_hair
from ...groom.foreign.foreign_curves import chosen, is_foreign
from ...groom.guides import line_drawing
from ...groom.selection import active_of_kind, guides_of, hair_of, parts_of, surface_of
from ...groom.systems.diagnostics import warnings_of
from ...host.notices import name_of, text_of
from ...settings.translations import interface_text
from ..operators.systems import is_combing
from ..setting_rows import row
from .tab import HairTab, draw_combing, split, write


class VELLUS_PT_surface(HairTab, bpy.types.Panel):
    """Mesh that the hair grows on"""

    bl_label = "Surface"
    bl_idname = "VELLUS_PT_surface"

    def draw(self, context):
        layout = split(self.layout)
        drawn = line_drawing.drawn_for(context.object)
        if drawn is not None:
            _draw_lines(layout, context, drawn)
            return
        if is_foreign(context.object):
            _draw_foreign(layout, context)
            return
        surface, parts = surface_of(context.object), parts_of(context.object)
        active = active_of_kind(context.object, "HAIR") or active_of_kind(context.object, "GUIDES")
        if active is not None:
            row(layout, active, "surface")
        elif surface is not None:
            layout.label(text=name_of(surface), icon="MESH_DATA", translate=False)
        else:
            write(layout, context, interface_text("Select a mesh to grow hair on."), "INFO")
            return
        for warning in warnings_of(surface, parts):
            box = layout.box()
            write(box, context, warning.text, "ERROR")
            if warning.operator:
                box.operator(warning.operator)
        if particle_hair.systems_of(context.object):
            layout.operator("vellus.convert_particles", icon="PARTICLES")
        if foreign_meshes.is_hair_mesh_chosen(context.object, context.selected_objects):
            write(layout, context, interface_text("Cards, tubes and locks can become hair on the other mesh."), "INFO")
            layout.operator("vellus.mesh_to_hair", icon="MESH_PLANE")
        if parts:
            _draw_tools(layout, context)
            _draw_combing_settings(layout, context)


def _draw_lines(layout, context, drawn):
    """Draw a hint and the button that stops drawing lines of a Curves datablock."""
    name = "vellus.draw_parting" if drawn.vellus.kind == "HAIR" else "vellus.draw_flow"
    message = "Draw lines on the surface. They take effect immediately."
    if line_drawing.tie_of(drawn) == context.object:
        name = "vellus.draw_tie"
        message = (
            "Begin each line at its tie. For cornrows, disable the option below. Stop drawing before you use Gather."
        )
    write(layout, context, interface_text(message), "INFO")
    if name == "vellus.draw_tie":
        layout.prop(context.tool_settings.curve_paint_settings, "use_stroke_endpoints")
    layout.operator(name, text="Stop Drawing", icon="CHECKMARK")


def _draw_foreign(layout, context):
    if context.object.type == "CURVES":
        row(layout, context.object.data, "surface")
    write(
        layout,
        context,
        interface_text("Turn these curves into guides: they keep their shape, and hair grows between them."),
        "INFO",
    )
    layout.operator("vellus.use_as_guides", icon="OUTLINER_OB_CURVES")
    write(layout, context, interface_text("Or use the curves themselves as hair."), "INFO")
    layout.operator("vellus.use_as_hair", icon="CURVES")
    count = len(chosen(context.object, context.selected_objects))
    if count > 1:
        write(layout, context, interface_text("The {count} selected objects become one.", count=count), "INFO")


def _draw_tools(layout, context):
    column = layout.column(align=True)
    if not is_combing(context) or surface_of(context.object) is None:  # the Hair Systems panel has Stop Combing
        draw_combing(column, context)
    column.operator("vellus.select_guides", text="Select Guides", icon="RESTRICT_SELECT_OFF")
    column.operator("vellus.select_hair", text="Select Hair", icon="RESTRICT_SELECT_OFF")
    column.operator("vellus.transfer_groom", icon="DUPLICATE")
    column.operator("vellus.delete_hair", icon="TRASH")


def _draw_combing_settings(layout, context):
    """Draw the settings for combing guides: whether they stay outside, and whether hair is shown with its styles."""
    hair, guides = hair_of(context.object), guides_of(context.object)
    if guides is None:
        return
    row(layout, guides.vellus, "keeps_outside")
    if hair is not None and len(hair.vellus.styles):
        row(layout, guides.vellus, "shows_styles_while_combing")


class VELLUS_PT_surface_uvs(HairTab, bpy.types.Panel):
    """UV map that hair nodes use to find roots on the surface"""

    bl_label = "UV Map"
    bl_idname = "VELLUS_PT_surface_uvs"
    bl_parent_id = "VELLUS_PT_surface"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return surface_of(context.object) is not None

    def draw(self, context):
        layout = self.layout
        used = sorted({text_of(part, "surface_uv_map") for part in parts_of(context.object)} - {""})
        if used:
            layout.label(text=", ".join(used), icon="GROUP_UVS", translate=False)
        column = layout.column(align=True)
        column.operator("vellus.check_uvs", icon="VIEWZOOM")
        column.operator("vellus.use_uv_map", icon="FILE_REFRESH")
        column.operator("vellus.make_uv_map", icon="UV")


CLASSES = (VELLUS_PT_surface, VELLUS_PT_surface_uvs)
