# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair Systems panel: the list of a mesh's hair systems."""

import bpy

from ...groom.selection import object_of, surface_of
from ...groom.systems.diagnostics import color_note
from ...groom.systems.hair_systems import edited_system, guides_of_system, systems_of
from ...settings import asset_libraries
from .. import setting_rows
from ..operators.systems import is_combing
from .tab import HairTab, draw_combing, write

_ROWS = 3  # minimum rows of the list


class VELLUS_UL_systems(bpy.types.UIList):
    """The hair systems of a mesh: a name, an eye and a camera for each"""

    bl_idname = "VELLUS_UL_systems"

    def filter_items(self, context, data, propname):
        """Show only the Curves of hair systems on the active mesh."""
        systems = set(systems_of(surface_of(context.object), context.view_layer))
        shown = [self.bitflag_filter_item if curves in systems else 0 for curves in getattr(data, propname)]
        return shown, []

    def draw_item(self, context, layout, _data, curves, _icon, _active_data, _active_property, _index=0, _flag=0):
        """Draw a hair system."""
        shown = object_of(curves, context.view_layer)
        is_hair = curves.vellus.kind == "HAIR"
        row = layout.row(align=True)
        row.prop(shown.vellus_system, "title", text="", emboss=False, icon="CURVES_DATA" if is_hair else "CURVE_DATA")
        eye = "HIDE_OFF" if shown.vellus_system.is_visible else "HIDE_ON"
        row.prop(shown.vellus_system, "is_visible", text="", emboss=False, icon=eye)
        if is_hair:  # renders show no guides
            row.prop(shown, "hide_render", text="", emboss=False)


class VELLUS_PT_systems(HairTab, bpy.types.Panel):
    """The hair systems on the active mesh"""

    bl_label = "Hair Systems"
    bl_idname = "VELLUS_PT_systems"

    @classmethod
    def poll(cls, context):
        return surface_of(context.object) is not None

    def draw(self, context):
        layout, surface = self.layout, surface_of(context.object)
        if not systems_of(surface, context.view_layer):
            if len(surface.vertex_groups):
                setting_rows.search_row(layout, surface.vellus_new_hair, "mask", surface, "vertex_groups")
            layout.operator("vellus.add_hair", icon="ADD")
            layout.operator("vellus.apply_groom", icon="ASSET_MANAGER", text="Apply Groom…")
            if not asset_libraries.shipped_name():
                layout.operator("vellus.add_grooms", icon="ADD")
            return
        row = layout.row()
        row.template_list(
            "VELLUS_UL_systems", "", bpy.data, "hair_curves", context.view_layer, "vellus_system", rows=_ROWS
        )
        column = row.column(align=True)
        column.operator("vellus.add_hair", text="", icon="ADD")
        column.operator("vellus.delete_system", text="", icon="REMOVE")
        system = edited_system(context.view_layer)
        guides = None if system is None else guides_of_system(system)
        if is_combing(context):  # at the top of a long tab
            draw_combing(layout, context)
        if guides is not None and guides != system:
            layout.prop(guides.vellus, "show_guides")
            if _are_shown(guides, context.view_layer):
                row = layout.row(align=True)
                row.prop(guides.vellus, "guide_colors", text="")
                row.prop(guides.vellus, "guide_opacity")
                note = color_note(guides)
                if note:
                    write(layout, context, note, "INFO")


def _are_shown(guides, view_layer):
    """Whether viewports show guides: as set, selected, or in an edit mode."""
    shown = object_of(guides, view_layer)
    return guides.vellus.show_guides or (shown is not None and (shown.select_get() or shown.mode != "OBJECT"))


LISTS = (VELLUS_UL_systems,)

CLASSES = (VELLUS_PT_systems,)
