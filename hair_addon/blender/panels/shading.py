# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading: how strands scatter light, and looks to begin with."""

import bpy

from ...core.shading import appearance
from ...core.shading.appearance import Appearance
from ...core.shading.presets import PRESETS
from .. import saved_looks
from ..selection import hair_of
from ..translations import CONTEXT
from .tab import HairTab, others, rows, split, write

_COLORS = tuple(name for names in appearance.COLOR_FIELDS.values() for name in names)


class _OfHair(HairTab):
    @classmethod
    def poll(cls, context):
        return hair_of(context.object) is not None


class VELLUS_PT_looks(bpy.types.Panel):
    """Looks to begin with: Vellus's own, and those that were saved"""

    bl_label = "Looks"
    bl_idname = "VELLUS_PT_looks"
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_options = {"INSTANCED"}
    bl_ui_units_x = 10
    bl_translation_context = CONTEXT

    def draw(self, _context):
        layout = self.layout
        layout.emboss = "PULLDOWN_MENU"
        layout.operator_context = "EXEC_DEFAULT"
        column = layout.column(align=True)
        for identifier, (label, _look) in PRESETS.items():
            column.operator("vellus.apply_preset", text=label).preset = identifier
        layout.separator()
        column = layout.column(align=True)
        for name in saved_looks.names():
            row = column.row(align=True)
            row.operator("vellus.apply_saved_look", text=bpy.path.display_name(name), translate=False).name = name
            row.operator("vellus.remove_look", text="", icon="REMOVE").name = name
        layout.operator_context = "INVOKE_DEFAULT"
        layout.operator("vellus.save_look", text="Save Look", icon="ADD")


class VELLUS_PT_shading(_OfHair, bpy.types.Panel):
    """How strands scatter light"""

    bl_label = "Shading"
    bl_idname = "VELLUS_PT_shading"

    def draw_header_preset(self, _context):
        layout = self.layout
        layout.emboss = "NONE"
        layout.popover(panel="VELLUS_PT_looks", icon="PRESET", text="")

    def draw(self, context):
        layout = split(self.layout)
        state = hair_of(context.object).vellus
        if state.shading_status:
            write(layout, context, state.shading_status, "ERROR")
        layout.prop(state, "is_drawn")
        layout.prop(state, "viewport_percentage")
        layout.prop(state, "model")
        if state.model != "KAJIYA_KAY":
            layout.prop(state.appearance, "mode")


class _OfShading(_OfHair):
    bl_parent_id = "VELLUS_PT_shading"
    settings = ()

    def draw(self, context):
        rows(split(self.layout), hair_of(context.object).vellus.appearance, Appearance, self.settings)


class VELLUS_PT_shading_color(_OfHair, bpy.types.Panel):
    """What the colour of hair follows from"""

    bl_label = "Color"
    bl_idname = "VELLUS_PT_shading_color"
    bl_parent_id = "VELLUS_PT_shading"

    def draw(self, context):
        look = hair_of(context.object).vellus.appearance
        rows(
            split(self.layout),
            look,
            Appearance,
            ("parametrization", *appearance.COLOR_FIELDS[look.parametrization]),
        )


class VELLUS_PT_shading_fibre(_OfShading, bpy.types.Panel):
    """The surface of the fibre"""

    bl_label = "Roughness"
    bl_idname = "VELLUS_PT_shading_fibre"
    settings = others(Appearance, _COLORS, appearance.STRAND_FIELDS, ("mode", "parametrization"))


class VELLUS_PT_shading_variation(_OfShading, bpy.types.Panel):
    """What differs between strands and along them"""

    bl_label = "Variation"
    bl_idname = "VELLUS_PT_shading_variation"
    bl_options = {"DEFAULT_CLOSED"}
    settings = appearance.STRAND_FIELDS


CLASSES = (
    VELLUS_PT_looks,
    VELLUS_PT_shading,
    VELLUS_PT_shading_color,
    VELLUS_PT_shading_fibre,
    VELLUS_PT_shading_variation,
)
