# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles panel: the list of a hair's styles, and the settings of the active one."""

import bpy

from ....core.errors import HairError
from ....core.files import style_presets
from ....core.styling.base import ProfiledSettings
from ....core.styling.kinds import KINDS
from ...data.strands.curves import grown_on
from ...groom.selection import hair_of
from ...groom.styles import painted_masks
from ...groom.styles.hair_styles import points_wanted
from ...groom.styles.style_notes import notes_of
from ...settings import saved_styles, style_items
from ...settings.translations import interface_text
from .. import picture_menus, setting_rows
from .preset_menu import PresetMenu
from .tab import HairTab, split, write

_ROWS = 5  # minimum rows of the list, as high as its buttons


def _active_of(context):
    """Return the active style's properties, None if there is none."""
    hair = hair_of(context.object)
    return None if hair is None else style_items.active_of(hair.vellus)


class VELLUS_UL_styles(bpy.types.UIList):
    """The styles of a hair: a name and a check box for each"""

    bl_idname = "VELLUS_UL_styles"

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property, _index=0, _flag=0):
        """Draw a style."""
        row = layout.row(align=True)
        row.prop(item, "name", text="", emboss=False)
        row.prop(style_items.group_of(item), "is_on", text="")


class VELLUS_PT_style_presets(PresetMenu, bpy.types.Panel):
    """Built-in and saved style presets"""

    bl_label = "Style Presets"
    bl_idname = "VELLUS_PT_style_presets"
    apply_preset, apply_saved = "vellus.apply_style_preset", "vellus.apply_saved_style"
    save, remove_saved = "vellus.save_style_preset", "vellus.remove_style_preset"
    save_label = "Save Style Preset"

    @staticmethod
    def presets():
        return style_presets.PRESETS.items()

    @staticmethod
    def saved():
        return ((name, 0) for name in saved_styles.names())


class VELLUS_PT_styles(HairTab, bpy.types.Panel):
    """Styles of the strands, applied from top to bottom"""

    bl_label = "Styles"
    bl_idname = "VELLUS_PT_styles"

    @classmethod
    def poll(cls, context):
        return hair_of(context.object) is not None

    def draw_header_preset(self, context):
        layout = self.layout
        picture_menus.draw(layout, context, "style")
        layout.emboss = "NONE"
        layout.popover(panel="VELLUS_PT_style_presets", icon="PRESET", text="")

    def draw(self, context):
        layout = self.layout
        hair = hair_of(context.object)
        state = hair.vellus
        if not len(state.styles):
            layout.operator_menu_enum("vellus.add_style", "style", text="Add Style", icon="ADD")
            return
        row = layout.row()
        row.template_list("VELLUS_UL_styles", "", state, "styles", state, "active_style", rows=_ROWS)
        column = row.column(align=True)
        column.operator_menu_enum("vellus.add_style", "style", text="", icon="ADD")
        column.operator("vellus.remove_style", text="", icon="REMOVE")
        column.separator()
        column.operator("vellus.move_style", text="", icon="TRIA_UP").direction = "UP"
        column.operator("vellus.move_style", text="", icon="TRIA_DOWN").direction = "DOWN"
        column.separator()
        column.operator("vellus.duplicate_style", text="", icon="DUPLICATE")
        item = style_items.active_of(state)
        if item is None:
            return
        for note in notes_of(hair, item):
            write(layout, context, note, "INFO")
        column = split(layout).column()
        column.active = style_items.group_of(item).is_on
        setting_rows.style_rows(column, item)
        if item.kind == "CURL":
            _draw_points(layout, context, hair)


def _draw_points(layout, context, hair):
    """Draw a note and a button if curls need more points per strand."""
    try:
        wanted, present = points_wanted(hair), hair.vellus.hair.point_count
    except HairError:  # already shown as the status of the hair
        return
    if wanted > present:
        message = interface_text("Smooth curls need {wanted} points per strand.", wanted=wanted)
        write(layout, context, message, "INFO")
        layout.operator("vellus.use_points")


class _OfStyle(HairTab):
    bl_parent_id = "VELLUS_PT_styles"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return _active_of(context) is not None


class VELLUS_PT_styles_profile(_OfStyle, bpy.types.Panel):
    """Amount of the style from root to tip"""

    bl_label = "Root to Tip"
    bl_idname = "VELLUS_PT_styles_profile"

    @classmethod
    def poll(cls, context):
        item = _active_of(context)
        return item is not None and issubclass(KINDS[item.kind], ProfiledSettings)

    def draw(self, context):
        setting_rows.profile_rows(split(self.layout), _active_of(context))


class VELLUS_PT_styles_mask(_OfStyle, bpy.types.Panel):
    """Where on the surface the style acts"""

    bl_label = "Mask"
    bl_idname = "VELLUS_PT_styles_mask"

    def draw(self, context):
        surface = grown_on(hair_of(context.object))
        setting_rows.style_mask_rows(split(self.layout), _active_of(context), surface)
        column = self.layout.column(align=True)
        painting = painted_masks.is_painting(context.object)
        text, icon = ("Stop Painting", "CHECKMARK") if painting else ("Paint Mask", "BRUSH_DATA")
        column.operator("vellus.paint_style_mask", text=text, icon=icon)
        column.operator("vellus.mask_from_selection", icon="RESTRICT_SELECT_OFF")


LISTS = (VELLUS_UL_styles,)

CLASSES = (VELLUS_PT_style_presets, VELLUS_PT_styles, VELLUS_PT_styles_profile, VELLUS_PT_styles_mask)
