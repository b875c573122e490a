# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers panel: the list of layers of guides, the topmost first, and the weight and mask of the active one."""

import bpy

from ...groom.selection import guides_of, surface_of
from ...settings import layer_items
from ...settings.translations import interface_text
from .. import setting_rows
from .tab import HairTab, split, write

_ROWS = 5  # minimum rows of the list, as high as its buttons


class VELLUS_UL_layers(bpy.types.UIList):
    """The layers of guides: a name, a weight and an eye for each; the list begins with the topmost"""

    bl_idname = "VELLUS_UL_layers"

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property, _index=0, _flag=0):
        """Draw a layer."""
        row = layout.row(align=True)
        row.prop(item, "name", text="", emboss=False)
        sides = row.row(align=True)
        sides.active = item.is_on
        sides.prop(item, "weight", text="", emboss=False)
        row.prop(item, "is_on", text="", icon="HIDE_OFF" if item.is_on else "HIDE_ON", emboss=False)

    def filter_items(self, _context, data, name):
        """Draw the topmost layer first."""
        count = len(getattr(data, name))
        return [self.bitflag_filter_item] * count, list(range(count - 1, -1, -1))


class VELLUS_PT_layers(HairTab, bpy.types.Panel):
    """Layers of combing, each with a weight"""

    bl_label = "Layers"
    bl_idname = "VELLUS_PT_layers"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return guides_of(context.object) is not None

    def draw(self, context):
        layout, guides = self.layout, guides_of(context.object)
        state = guides.vellus
        if not len(state.layers):
            layout.operator("vellus.add_layer", icon="ADD")
            return
        row = layout.row()
        row.template_list("VELLUS_UL_layers", "", state, "layers", state, "active_layer", rows=_ROWS)
        column = row.column(align=True)
        column.operator("vellus.add_layer", text="", icon="ADD")
        column.operator("vellus.remove_layer", text="", icon="REMOVE")
        column.separator()
        column.operator("vellus.move_layer", text="", icon="TRIA_UP").direction = "UP"
        column.operator("vellus.move_layer", text="", icon="TRIA_DOWN").direction = "DOWN"
        column.separator()
        column.operator("vellus.duplicate_layer", text="", icon="DUPLICATE")
        column.operator("vellus.merge_layer_down", text="", icon="TRIA_DOWN_BAR")
        item = layer_items.active_of(state)
        if item is not None:
            if not item.is_on or item.weight < layer_items.LEAST_WEIGHT:
                message = interface_text("Hidden layers, and layers without weight, cannot be combed.")
                write(layout, context, message, "INFO")
            column = split(layout).column()
            setting_rows.row(column, item, "weight")
            surface = surface_of(context.object) or guides.surface
            if surface is None:
                setting_rows.row(column, item, "mask")
            else:
                setting_rows.search_row(column, item, "mask", surface, "vertex_groups")
        layout.operator("vellus.apply_layers", icon="CHECKMARK")


LISTS = (VELLUS_UL_layers,)

CLASSES = (VELLUS_PT_layers,)
