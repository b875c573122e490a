# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides panel: number, length and distribution."""

import bpy

from ....core.grooming import cost
from ....core.grooming.groom import GuideSettings
from ...data.scene import triangle_count
from ...data.strands.curves import is_hand_made
from ...groom.foreign.foreign_curves import is_foreign
from ...groom.guides import guide_states
from ...groom.selection import guides_of, guides_to_regenerate, surface_of
from ...settings import selection_names
from ...settings.translations import interface_text
from .. import menus, setting_rows, tools
from .tab import HairTab, draw_work, split, write, write_stale, write_status


class VELLUS_PT_guides(HairTab, bpy.types.Panel):
    """Guide hairs that strands follow"""

    bl_label = "Guides"
    bl_idname = "VELLUS_PT_guides"

    @classmethod
    def poll(cls, context):
        has_place = surface_of(context.object) is not None or guides_of(context.object) is not None
        return has_place and not is_foreign(context.object)

    def draw(self, context):
        layout = split(self.layout)
        guides, surface = guides_of(context.object), surface_of(context.object)
        if guides is None:
            _draw_work(layout, context, surface, GuideSettings())
            layout.operator("vellus.distribute_guides", text="New Guide Set", icon="OUTLINER_OB_CURVES")
            return
        write_status(layout, context, guides.vellus)
        if is_hand_made(guides):
            _draw_hand_made(layout, context, guides)
            return
        group = guides.vellus.guides
        if guide_states.of(guides).is_combed:
            _draw_combed(layout, context, guides)
        setting_rows.guide_rows(layout, group, surface, are_combed=guide_states.of(guides).is_combed)
        setting_rows.row(layout, guides.vellus, "is_live")
        write_stale(layout, context, guides.vellus)
        if len(guides.curves) != group.guide_count:  # guides were added or removed
            layout.label(text=interface_text("{count} guides", count=len(guides.curves)), icon="INFO", translate=False)
        if surface is not None:
            _draw_work(layout, context, surface, group)
        if guides_to_regenerate(context.object) is not None:
            column = layout.column(align=True)  # one line would be clipped at the default sidebar width
            column.operator("vellus.distribute_guides", text="Regenerate Guides", icon="FILE_REFRESH")
            if not len(guides_to_regenerate(context.object).vellus.layers):
                column.label(text="(Discards Combing)", icon="BLANK1")
        else:
            layout.operator("vellus.distribute_guides", text="New Guide Set", icon="ADD")


def _draw_combed(layout, context, guides):
    """Show which settings have no effect on combed guides."""
    message = interface_text("Combed: gray settings have no effect. Guide Tools change guides and keep their combing.")
    write(layout, context, message, "INFO")
    length = guide_states.of(guides).length / context.scene.unit_settings.scale_length
    shown = bpy.utils.units.to_string("METRIC", "LENGTH", length, precision=3)
    layout.label(text=interface_text("Median length: {length}", length=shown), icon="BLANK1", translate=False)


def _draw_hand_made(layout, context, guides):
    message = interface_text("Hand-made guides: settings do not apply, and they are never regenerated.")
    write(layout, context, message, "INFO")
    layout.label(text=interface_text("{count} guides", count=len(guides.curves)), translate=False)
    setting_rows.row(layout, guides.vellus, "is_live")
    write_stale(layout, context, guides.vellus)
    if guides_to_regenerate(context.object) is None:
        layout.operator("vellus.distribute_guides", text="New Guide Set", icon="ADD")


def _draw_work(layout, context, surface, settings):
    """Draw the estimate for generating guides; settings: `GuideSettings`, or properties of the same names."""
    face_count = triangle_count(surface, context.view_layer)
    seconds, byte_count = (cost(settings, face_count) for cost in (cost.guide_seconds, cost.guide_work_bytes))
    draw_work(layout, seconds, byte_count)


class _OfAnyGuides(HairTab):
    bl_parent_id = "VELLUS_PT_guides"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return guides_of(context.object) is not None


class _OfGuides(_OfAnyGuides):
    @classmethod
    def poll(cls, context):
        guides = guides_of(context.object)
        return guides is not None and not is_hand_made(guides)


def _column(layout, context):
    """Return a column for settings without effect on combed guides."""
    column = split(layout).column()
    column.active = not guide_states.of(guides_of(context.object)).is_combed
    return column


class VELLUS_PT_guides_growth(_OfGuides, bpy.types.Panel):
    """Length and direction of the guides"""

    bl_label = "Growth"
    bl_idname = "VELLUS_PT_guides_growth"

    def draw(self, context):
        column = _column(self.layout, context)
        setting_rows.growth_rows(column, guides_of(context.object).vellus.guides)
        column.operator("vellus.draw_flow", icon="GREASEPENCIL")


class VELLUS_PT_guides_placement(_OfGuides, bpy.types.Panel):
    """Distribution of the guides on the surface"""

    bl_label = "Placement"
    bl_idname = "VELLUS_PT_guides_placement"

    def draw(self, context):
        setting_rows.placement_rows(_column(self.layout, context), guides_of(context.object).vellus.guides)


class VELLUS_PT_guides_tools(_OfAnyGuides, bpy.types.Panel):
    """Tools that change guides and keep their combing"""

    bl_label = "Guide Tools"
    bl_idname = "VELLUS_PT_guides_tools"

    def draw(self, context):
        tools.draw_paint_flow(self.layout, context)
        menus.draw_guide_tools(self.layout.column(align=True))


class VELLUS_PT_guides_frozen(_OfAnyGuides, bpy.types.Panel):
    """Guides that are not combed"""

    bl_label = "Freeze"
    bl_idname = "VELLUS_PT_guides_frozen"

    def draw(self, _context):
        column = self.layout.column(align=True)
        column.operator("vellus.freeze_selected", icon="FREEZE")
        column.operator("vellus.unfreeze_all")
        column.operator("vellus.invert_frozen")


class VELLUS_PT_guides_selections(_OfAnyGuides, bpy.types.Panel):
    """Saved selections of guides"""

    bl_label = "Selections"
    bl_idname = "VELLUS_PT_guides_selections"

    def draw(self, context):
        self.layout.operator("vellus.save_selection", icon="ADD")
        column = self.layout.column(align=True)
        for name in selection_names.names_of(guides_of(context.object)):
            row = column.row(align=True)
            row.operator("vellus.select_saved", text=name, icon="RESTRICT_SELECT_OFF", translate=False).name = name
            row.operator("vellus.remove_selection", text="", icon="X").name = name


CLASSES = (
    VELLUS_PT_guides,
    VELLUS_PT_guides_growth,
    VELLUS_PT_guides_placement,
    VELLUS_PT_guides_tools,
    VELLUS_PT_guides_frozen,
    VELLUS_PT_guides_selections,
)
