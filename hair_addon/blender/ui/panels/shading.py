# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading panel: scattering settings and looks."""

import bpy

from ....core.shading import appearance
from ....core.shading.appearance import Appearance
from ....core.shading.presets import PRESETS
from ...groom.selection import active_of_kind, hair_of, object_of
from ...groom.systems.diagnostics import modifier_notes
from ...render import late_layers
from ...settings import saved_looks
from ...settings.translations import interface_text
from .. import look_previews, picture_menus
from ..setting_rows import others, row, rows
from .preset_menu import PresetMenu
from .tab import HairTab, split, write, write_missing_pictures, write_status

_COLORS = tuple(name for names in appearance.COLOR_FIELDS.values() for name in names)


class _OfHair(HairTab):
    @classmethod
    def poll(cls, context):
        return hair_of(context.object) is not None


class VELLUS_PT_looks(PresetMenu, bpy.types.Panel):
    """Built-in looks and saved looks"""

    bl_label = "Looks"
    bl_idname = "VELLUS_PT_looks"
    apply_preset, apply_saved = "vellus.apply_preset", "vellus.apply_saved_look"
    save, remove_saved = "vellus.save_look", "vellus.remove_look"
    save_label = "Save Look"

    @staticmethod
    def presets():
        return ((name, label) for name, (label, _look) in PRESETS.items())

    @staticmethod
    def saved():
        return ((name, look_previews.swatch(name)) for name in saved_looks.names())


class VELLUS_PT_shading(_OfHair, bpy.types.Panel):
    """Scattering of light by strands"""

    bl_label = "Shading"
    bl_idname = "VELLUS_PT_shading"

    def draw_header_preset(self, context):
        layout = self.layout
        picture_menus.draw(layout, context, "look")
        layout.emboss = "NONE"
        layout.popover(panel="VELLUS_PT_looks", icon="PRESET", text="")

    def draw(self, context):
        layout = split(self.layout)
        state = hair_of(context.object).vellus
        write_status(layout, context, state, "shading_status")
        if (baked := late_layers.parts()) is not None:
            note = "Radial roughness in viewports is approximate: {done} of {count} tables are baked."
            write(layout, context, interface_text(note, done=baked[0], count=baked[1]), "INFO")
        row(layout, state, "is_drawn")
        for note in modifier_notes(_hair_object(context)):
            write(layout, context, note, "INFO")
        write_missing_pictures(layout, context)
        for name in ("viewport_percentage", "is_reduced_in_viewport", "model"):
            row(layout, state, name)
        if state.model != "KAJIYA_KAY":
            row(layout, state.appearance, "mode")
        row(layout, context.scene.vellus, "has_preview_shadow")


def _hair_object(context):
    """Return the active object if it is hair, else the object of the hair in the panel; None if there is none."""
    if active_of_kind(context.object, "HAIR") is not None:
        return context.object
    return object_of(hair_of(context.object), context.view_layer)


class _OfShading(_OfHair):
    bl_parent_id = "VELLUS_PT_shading"
    settings = ()

    def draw(self, context):
        rows(split(self.layout), hair_of(context.object).vellus.appearance, Appearance, self.settings)


class VELLUS_PT_shading_color(_OfHair, bpy.types.Panel):
    """Method to set the hair color"""

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
    """Roughness and refraction of the fiber"""

    bl_label = "Roughness"
    bl_idname = "VELLUS_PT_shading_fibre"
    settings = others(Appearance, _COLORS, appearance.STRAND_FIELDS, ("mode", "parametrization"))


class VELLUS_PT_shading_variation(_OfShading, bpy.types.Panel):
    """Variation between strands and along them"""

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
