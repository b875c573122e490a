# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolation: strands between the guides."""

import bpy

from ...core import estimate
from ...core.groom import HairSettings
from ..scene import triangle_count
from ..selection import active_of_kind, guides_of, hair_of
from ..translations import interface_text
from .tab import HairTab, draw_work, megabytes, others, rows, split, write

_OWN_ROW = ("density_group", "influence_distance")
_ADVANCED = ("automatic_influence", "neighbour_limit", "seed")


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
        rows(layout, state.hair, HairSettings, others(HairSettings, _OWN_ROW, _ADVANCED))
        if hair.surface is not None:
            layout.prop_search(state.hair, "density_group", hair.surface, "vertex_groups")
        layout.prop(state, "is_live")
        _draw_cost(layout, state.hair.strand_count)
        if hair.surface is not None:
            face_count = triangle_count(hair.surface, context.view_layer)
            costs = estimate.hair_seconds, estimate.hair_work_bytes
            draw_work(layout, *(cost(state.hair, face_count) for cost in costs))
        is_again = active_of_kind(context.object, "HAIR") is not None
        text, icon = ("Interpolate Again", "FILE_REFRESH") if is_again else ("Add More Hair", "ADD")
        layout.operator("vellus.interpolate_hair", text=text, icon=icon)


def _draw_cost(layout, strand_count):
    """What the wanted number of strands takes in memory: arithmetic."""
    text = interface_text(
        "{memory}, on the GPU {gpu_memory}",
        memory=megabytes(estimate.curves_bytes(strand_count)),
        gpu_memory=megabytes(estimate.gpu_bytes(strand_count)),
    )
    layout.label(text=text, icon="MEMORY", translate=False)


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


CLASSES = (VELLUS_PT_interpolation, VELLUS_PT_interpolation_advanced)
