# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands panel: number of strands and interpolation."""

import bpy

from ....core.grooming import cost
from ...data.scene import triangle_count
from ...data.strands.curves import grown_on, is_hand_made
from ...groom import hair_memory
from ...groom.selection import active_of_kind, guides_of, hair_of
from ...groom.styles import painted_masks
from ...groom.systems.diagnostics import parting_warnings, sharing_note
from ...host import memory
from ...render import hair_cache
from ...settings.translations import error_text, interface_text
from .. import map_rows, setting_rows
from .tab import HairTab, draw_work, megabytes, split, write, write_stale, write_status


class VELLUS_PT_interpolation(HairTab, bpy.types.Panel):
    """Strands between the guides"""

    bl_label = "Strands"
    bl_idname = "VELLUS_PT_interpolation"

    @classmethod
    def poll(cls, context):
        return guides_of(context.object) is not None or hair_of(context.object) is not None

    def draw(self, context):
        layout = split(self.layout)
        hair = hair_of(context.object)
        if hair is None:
            layout.operator("vellus.interpolate_hair", text="Strands from These Guides", icon="CURVES")
            return
        state = hair.vellus
        write_status(layout, context, state)
        error = hair_cache.note_of(hair)
        if error is not None:
            write(layout, context, error_text(error), "ERROR")
        if is_hand_made(hair):
            text = "These strands are kept unchanged. Regenerate Strands replaces them with strands between the guides."
            write(layout, context, interface_text(text), "INFO")
        setting_rows.row(layout, state, "guide_curves")
        shared = sharing_note(hair)
        if shared:
            write(layout, context, shared, "INFO")
            layout.operator("vellus.make_own_guides")
        setting_rows.strand_rows(layout, state.hair, grown_on(hair))
        painting = painted_masks.is_painting(context.object)
        text, icon = ("Stop Painting", "CHECKMARK") if painting else ("Paint Density", "BRUSH_DATA")
        layout.operator("vellus.paint_density", text=text, icon=icon)
        map_rows.ramp_rows(layout, hair)
        setting_rows.row(layout, state, "is_live")
        write_stale(layout, context, state)
        _draw_cost(layout, state.hair, hair_cache.drawn_bytes(hair))
        share = memory.share_of_free(hair_memory.strand_bytes(state.hair, hair))
        if share > memory.MUCH:
            text = interface_text("These strands take {percent}% of the free memory", percent=round(100.0 * share))
            layout.label(text=text, icon="ERROR", translate=False)
        if grown_on(hair) is not None:
            face_count = triangle_count(grown_on(hair), context.view_layer)
            costs = cost.hair_seconds, cost.hair_work_bytes
            draw_work(layout, *(cost(state.hair, face_count) for cost in costs))
        is_again = active_of_kind(context.object, "HAIR") is not None
        text, icon = ("Regenerate Strands", "FILE_REFRESH") if is_again else ("Strands from These Guides", "ADD")
        layout.operator("vellus.interpolate_hair", text=text, icon=icon)


def _draw_cost(layout, group, drawn_bytes):
    """Draw the memory estimate for the strand count, and the memory in use on the GPU while strands are drawn."""
    slot_count = group.neighbour_limit if group.guide_map else 0
    text = interface_text(
        "{memory}, {gpu_memory} on the GPU",
        memory=megabytes(cost.curves_bytes(group.strand_count, group.point_count, slot_count)),
        gpu_memory=megabytes(
            cost.gpu_bytes(group.strand_count, group.point_count) if drawn_bytes is None else drawn_bytes
        ),
    )
    layout.label(text=text, icon="MEMORY", translate=False)


class VELLUS_PT_interpolation_parting(HairTab, bpy.types.Panel):
    """Guides that are not blended with each other"""

    bl_label = "Parting"
    bl_idname = "VELLUS_PT_interpolation_parting"
    bl_parent_id = "VELLUS_PT_interpolation"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return hair_of(context.object) is not None

    def draw(self, context):
        layout = split(self.layout)
        hair = hair_of(context.object)
        setting_rows.parting_rows(layout, hair.vellus.hair, grown_on(hair))
        layout.operator("vellus.draw_parting", icon="GREASEPENCIL")
        for warning in parting_warnings(hair):
            write(layout, context, warning.text, "ERROR")


class VELLUS_PT_interpolation_advanced(HairTab, bpy.types.Panel):
    """Blending of guides to strands"""

    bl_label = "Advanced"
    bl_idname = "VELLUS_PT_interpolation_advanced"
    bl_parent_id = "VELLUS_PT_interpolation"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return hair_of(context.object) is not None

    def draw(self, context):
        setting_rows.blending_rows(split(self.layout), hair_of(context.object).vellus.hair)


CLASSES = (VELLUS_PT_interpolation, VELLUS_PT_interpolation_parting, VELLUS_PT_interpolation_advanced)
