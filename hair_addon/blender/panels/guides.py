# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides: how many, how long, where."""

import bpy

from ...core import estimate
from ...core.groom import GuideSettings
from ..scene import triangle_count
from ..selection import guides_again, guides_of, surface_of
from ..translations import interface_text
from .tab import HairTab, draw_work, others, rows, split, write

_GROWTH = ("length_variation", "tilt", "gravity")
_PLACES = ("seed", "relax_iterations", "curvature", "symmetric")
_OWN_ROW = ("density_group", "density_image")


class VELLUS_PT_guides(HairTab, bpy.types.Panel):
    """The hairs that others follow"""

    bl_label = "Guides"
    bl_idname = "VELLUS_PT_guides"

    @classmethod
    def poll(cls, context):
        return surface_of(context.object) is not None or guides_of(context.object) is not None

    def draw(self, context):
        layout = split(self.layout)
        guides, surface = guides_of(context.object), surface_of(context.object)
        if guides is None:
            _draw_work(layout, context, surface, GuideSettings())
            layout.operator("vellus.distribute_guides", icon="OUTLINER_OB_CURVES")
            return
        if guides.vellus.status:
            write(layout, context, guides.vellus.status, "ERROR")
        group = guides.vellus.guides
        rows(layout, group, GuideSettings, others(GuideSettings, _GROWTH, _PLACES, _OWN_ROW))
        if surface is not None:
            layout.prop_search(group, "density_group", surface, "vertex_groups")
        layout.prop_search(group, "density_image", bpy.data, "images")
        layout.prop(guides.vellus, "is_live")
        if len(guides.curves) != group.guide_count:  # somebody added or removed some
            layout.label(text=interface_text("{count} guides", count=len(guides.curves)), icon="INFO", translate=False)
        if surface is not None:
            _draw_work(layout, context, surface, group)
        if guides_again(context.object) is not None:
            layout.operator("vellus.distribute_guides", text="Distribute Again", icon="FILE_REFRESH")
        else:
            layout.operator("vellus.distribute_guides", text="Add More Guides", icon="ADD")


def _draw_work(layout, context, surface, settings):
    """settings: `GuideSettings`, or properties of the same names."""
    face_count = triangle_count(surface, context.view_layer)
    seconds, byte_count = (cost(settings, face_count) for cost in (estimate.guide_seconds, estimate.guide_work_bytes))
    draw_work(layout, seconds, byte_count)


class _OfGuides(HairTab):
    bl_parent_id = "VELLUS_PT_guides"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return guides_of(context.object) is not None


class VELLUS_PT_guides_growth(_OfGuides, bpy.types.Panel):
    """How guides leave the surface"""

    bl_label = "Growth"
    bl_idname = "VELLUS_PT_guides_growth"

    def draw(self, context):
        rows(split(self.layout), guides_of(context.object).vellus.guides, GuideSettings, _GROWTH)


class VELLUS_PT_guides_placement(_OfGuides, bpy.types.Panel):
    """Where guides are rooted"""

    bl_label = "Placement"
    bl_idname = "VELLUS_PT_guides_placement"

    def draw(self, context):
        rows(split(self.layout), guides_of(context.object).vellus.guides, GuideSettings, _PLACES)


CLASSES = (VELLUS_PT_guides, VELLUS_PT_guides_growth, VELLUS_PT_guides_placement)
