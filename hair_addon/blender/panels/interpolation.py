# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolation: strands between the guides."""

import bpy

from ...core import estimate
from ...core.groom import HairSettings
from ..scene import triangle_count
from ..selection import active_of_kind, guides_of, hair_of
from ..surface_checks import parting_warnings
from ..translations import interface_text
from .tab import HairTab, draw_work, megabytes, others, rows, split, write

_OWN_ROW = ("density_group", "influence_distance", "region_group", "region_attribute", "part_lines")
_LIMITS = ("angle_limit", "length_limit")
_ADVANCED = ("automatic_influence", "neighbour_limit", "keep_length", "guide_map", "seed")


class VELLUS_PT_interpolation(HairTab, bpy.types.Panel):
    """Strands between the guides"""

    bl_label = "Interpolation"
    bl_idname = "VELLUS_PT_interpolation"

    @classmethod
    def poll(cls, context):
        return guides_of(context.object) is not None or hair_of(context.object) is not None

    def draw(self, context):
        layout = split(self.layout)
        hair = hair_of(context.object)
        if hair is None:
            layout.operator("vellus.interpolate_hair", icon="CURVES")
            return
        state = hair.vellus
        if state.status:
            write(layout, context, state.status, "ERROR")
        layout.prop(state, "guide_curves")
        rows(layout, state.hair, HairSettings, others(HairSettings, _OWN_ROW, _LIMITS, _ADVANCED))
        if hair.surface is not None:
            layout.prop_search(state.hair, "density_group", hair.surface, "vertex_groups")
        layout.prop(state, "is_live")
        _draw_cost(layout, state.hair)
        if hair.surface is not None:
            face_count = triangle_count(hair.surface, context.view_layer)
            costs = estimate.hair_seconds, estimate.hair_work_bytes
            draw_work(layout, *(cost(state.hair, face_count) for cost in costs))
        is_again = active_of_kind(context.object, "HAIR") is not None
        text, icon = ("Interpolate Again", "FILE_REFRESH") if is_again else ("Add More Hair", "ADD")
        layout.operator("vellus.interpolate_hair", text=text, icon=icon)


def _draw_cost(layout, group):
    """What the wanted number of strands takes in memory: arithmetic."""
    slot_count = group.neighbour_limit if group.guide_map else 0
    text = interface_text(
        "{memory}, on the GPU {gpu_memory}",
        memory=megabytes(estimate.curves_bytes(group.strand_count, slot_count=slot_count)),
        gpu_memory=megabytes(estimate.gpu_bytes(group.strand_count)),
    )
    layout.label(text=text, icon="MEMORY", translate=False)


class VELLUS_PT_interpolation_parting(HairTab, bpy.types.Panel):
    """Which guides are not mixed with each other"""

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
        group = hair.vellus.hair
        rows(layout, group, HairSettings, _LIMITS)
        if hair.surface is not None:
            layout.prop_search(group, "region_group", hair.surface, "vertex_groups")
            # Also what modifiers make, or guides carry, which is in no list.
            layout.prop_search(group, "region_attribute", hair.surface.data, "attributes", results_are_suggestions=True)
        layout.prop_search(group, "part_lines", bpy.data, "objects")
        for warning in parting_warnings(hair):
            write(layout, context, warning.text, "ERROR")


class VELLUS_PT_interpolation_advanced(HairTab, bpy.types.Panel):
    """Which guides a strand follows"""

    bl_label = "Advanced"
    bl_idname = "VELLUS_PT_interpolation_advanced"
    bl_parent_id = "VELLUS_PT_interpolation"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return hair_of(context.object) is not None

    def draw(self, context):
        layout = split(self.layout)
        group = hair_of(context.object).vellus.hair
        rows(layout, group, HairSettings, _ADVANCED)
        row = layout.row()
        row.active = not group.automatic_influence
        row.prop(group, "influence_distance")


CLASSES = (VELLUS_PT_interpolation, VELLUS_PT_interpolation_parting, VELLUS_PT_interpolation_advanced)
