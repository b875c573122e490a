# SPDX-License-Identifier: GPL-3.0-or-later
"""Popover of built-in and saved presets by name, with a button to save a new one."""

import bpy

from ...settings.translations import CONTEXT

_COLUMNS = 3


class PresetMenu:
    """Mixed into panels that implement `presets` and `saved`, and name their operators."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_options = {"INSTANCED"}
    bl_ui_units_x = 21
    bl_translation_context = CONTEXT

    apply_preset = apply_saved = remove_saved = save = save_label = ""

    @staticmethod
    def presets():
        """(identifier, label) of each built-in preset."""
        raise NotImplementedError

    @staticmethod
    def saved():
        """(name, icon or 0) of each saved preset."""
        raise NotImplementedError

    def draw(self, _context):
        """Draw all presets."""
        layout = self.layout
        layout.emboss = "PULLDOWN_MENU"
        layout.operator_context = "EXEC_DEFAULT"
        grid = layout.grid_flow(columns=_COLUMNS, row_major=True, even_columns=True, even_rows=True, align=True)
        for identifier, label in self.presets():
            grid.operator(self.apply_preset, text=label).preset = identifier
        layout.separator()
        column = layout.column(align=True)
        for name, icon in self.saved():
            line, text = column.row(align=True), bpy.path.display_name(name)
            line.operator(self.apply_saved, text=text, translate=False, icon_value=icon).name = name
            line.operator(self.remove_saved, text="", icon="REMOVE").name = name
        layout.operator_context = "INVOKE_DEFAULT"
        layout.operator(self.save, text=self.save_label, icon="ADD")
