# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that change combed guides in place."""

import bpy

from ....core.grooming.guide_tool_settings import (
    AttractSettings,
    CopySettings,
    CountSettings,
    DrapeSettings,
    LengthSettings,
    LiftSettings,
    MirrorSettings,
    OutsideSettings,
    SmoothSettings,
    ToolSettings,
    TrimSettings,
)
from ....core.grooming.ties.gather_settings import GatherSettings
from ....core.params import declared
from ...data import scene
from ...groom.dynamics import guide_draping
from ...groom.guides import gathered_guides, guide_additions, guide_tools, line_drawing, outside_guides
from ...groom.selection import guides_of, surface_of
from ...settings import setting_properties
from .. import setting_rows
from .base.hair_operator import HairOperator
from .base.modal import LongOperator

_MODES = {"OBJECT", "SCULPT_CURVES", "EDIT_CURVES"}
_COMMON = setting_properties.names_of(ToolSettings)


class GuideTool(HairOperator):
    """Mixin of tools that name their `Settings` and implement `apply`."""

    Settings = ToolSettings

    @classmethod
    def applies(cls, context):
        """Whether there are guides to change."""
        cls.poll_message_set("Select guides, the mesh they grow on, or hair that follows them.")
        return context.mode in _MODES and guides_of(context.object) is not None

    def apply(self, guides, settings, depsgraph):
        """Change guide Curves; returns the number of guides for the message."""
        raise NotImplementedError

    def prefill(self, guides):
        """Set defaults that depend on the guides, when the tool is called with a mouse or a key."""

    def invoke(self, context, _event):
        """Set defaults that depend on the guides, and change the guides."""
        self.prefill(guides_of(context.object))
        return self.execute(context)

    def change(self, context):
        """Change the guides and report the number changed."""
        settings = setting_properties.to_settings(self, self.Settings)
        return self.message(self.apply(guides_of(context.object), settings, context.evaluated_depsgraph_get()))

    def message(self, count):
        """Return (sentence, values) of the report."""
        return "{count} guides changed", {"count": count}

    def draw(self, context):
        """Draw the tool's settings and those shared by all tools."""
        self.draw_settings(self.layout)
        self.draw_choice(self.layout, surface_of(context.object))

    def draw_settings(self, layout):
        """Draw the rows of the tool's own settings."""
        for name, _default, _details in declared(self.Settings):
            if name not in _COMMON:
                setting_rows.row(layout, self.properties, name)

    def draw_choice(self, layout, surface):
        """Draw the rows that choose the affected guides."""
        setting_rows.row(layout, self.properties, "selected_only")
        if surface is not None:
            setting_rows.search_row(layout, self.properties, "mask", surface, "vertex_groups")


class VELLUS_OT_guide_length(GuideTool, bpy.types.Operator):
    """Scale the length of guides, set it, or keep it within a limit; combing is kept"""

    bl_idname = "vellus.guide_length"
    bl_label = "Guide Length"
    Settings = LengthSettings
    __annotations__ = setting_properties.annotations(LengthSettings)

    def prefill(self, guides):
        if not self.properties.is_property_set("length"):
            self.length = guide_tools.median_length(guides)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.change_lengths(guides, settings, depsgraph)

    def draw_settings(self, layout):
        for name in ("method", "factor" if self.method == "SCALE" else "length", "shorten"):
            setting_rows.row(layout, self.properties, name)


class VELLUS_OT_trim_guides(GuideTool, bpy.types.Operator):
    """Cut guides where the faces of a mesh, or the XY plane of another object such as an empty, cross them"""

    bl_idname = "vellus.trim_guides"
    bl_label = "Trim Guides"
    Settings = TrimSettings
    __annotations__ = setting_properties.annotations(TrimSettings)

    def invoke(self, context, event):
        """Cut with the other selected object, or open a dialog to pick one."""
        surface = surface_of(context.object)
        others = [o for o in context.selected_objects if o not in (context.object, surface) and o.type != "CURVES"]
        if len(others) == 1:
            self.cutter = others[0].name
        if not self.cutter and not bpy.app.background:
            return context.window_manager.invoke_props_dialog(self)
        return super().invoke(context, event)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.trim(guides, settings, depsgraph)

    def draw_settings(self, layout):
        setting_rows.search_row(layout, self.properties, "cutter", bpy.data, "objects")


class VELLUS_OT_change_guide_count(GuideTool, bpy.types.Operator):
    """Add guides between existing guides, or remove the most crowded ones; all others keep their combing"""

    bl_idname = "vellus.change_guide_count"
    bl_label = "Change Guide Count"
    Settings = CountSettings
    __annotations__ = setting_properties.annotations(CountSettings)

    def prefill(self, guides):
        if not self.properties.is_property_set("guide_count"):
            self.guide_count = max(len(guides.curves), 1)

    def apply(self, guides, settings, depsgraph):
        return guide_additions.change_count(guides, settings, depsgraph)

    def message(self, count):
        return "{count} guides", {"count": count}

    def draw_settings(self, layout):
        for name in ("method", "factor" if self.method == "FACTOR" else "guide_count"):
            setting_rows.row(layout, self.properties, name)


class VELLUS_OT_mirror_guides(GuideTool, bpy.types.Operator):
    """Replace the guides of one side of the object with mirrored copies of those on the other side"""

    bl_idname = "vellus.mirror_guides"
    bl_label = "Mirror Guides"
    Settings = MirrorSettings
    __annotations__ = setting_properties.annotations(MirrorSettings)

    def apply(self, guides, settings, depsgraph):
        return guide_additions.mirror(guides, settings, depsgraph)

    def message(self, count):
        return "{count} guides mirrored", {"count": count}


class VELLUS_OT_copy_guide_shape(GuideTool, bpy.types.Operator):
    """Copy the shape of the selected guides, or of those in a vertex group, to other guides"""

    bl_idname = "vellus.copy_guide_shape"
    bl_label = "Copy Guide Shape"
    Settings = CopySettings
    __annotations__ = setting_properties.annotations(CopySettings)

    def invoke(self, context, event):
        """Copy, or open a dialog if no source guides are selected or named."""
        if not self.source and not bpy.app.background and not guide_tools.is_any_selected(guides_of(context.object)):
            return context.window_manager.invoke_props_dialog(self)
        return super().invoke(context, event)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.copy_shape(guides, settings, depsgraph)

    def draw(self, context):
        surface = surface_of(context.object)
        if surface is not None:
            for name in ("source", "target"):
                setting_rows.search_row(self.layout, self.properties, name, surface, "vertex_groups")
        for name in ("mapping", "copy_length", "amount"):
            setting_rows.row(self.layout, self.properties, name)


class VELLUS_OT_smooth_guides(GuideTool, bpy.types.Operator):
    """Smooth guides along their length; roots and lengths are kept"""

    bl_idname = "vellus.smooth_guides"
    bl_label = "Smooth Guides"
    Settings = SmoothSettings
    __annotations__ = setting_properties.annotations(SmoothSettings)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.smooth(guides, settings, depsgraph)


class VELLUS_OT_lift_guides(GuideTool, bpy.types.Operator):
    """Turn guides toward the surface normal, most at their roots; lengths are kept"""

    bl_idname = "vellus.lift_guides"
    bl_label = "Lift Guides"
    Settings = LiftSettings
    __annotations__ = setting_properties.annotations(LiftSettings)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.lift(guides, settings, depsgraph)


class VELLUS_OT_push_outside(GuideTool, bpy.types.Operator):
    """Push points of guides that are inside the surface out of it; roots and lengths are kept"""

    bl_idname = "vellus.push_outside"
    bl_label = "Push Outside"
    Settings = OutsideSettings
    __annotations__ = setting_properties.annotations(OutsideSettings)

    def apply(self, guides, settings, depsgraph):
        return outside_guides.push(guides, settings, depsgraph)


_HEAD = 0.25  # [m] extent of a surface that the lengths of Gather are made for
_GATHERED = ("tie_radius", "tail_radius", "bun_radius", "pitch", "clearance")
_ROWS_OF_SHAPES = {
    "PONYTAIL": ("tie_radius", "tail_radius"),
    "BRAID": ("tie_radius", "tail_radius", "pitch"),
    "ROPE": ("tie_radius", "tail_radius", "pitch"),
    "CORNROWS": ("tie_radius", "pitch"),
    "BUN": ("tie_radius", "bun_radius", "turns"),
}


class VELLUS_OT_gather_guides(GuideTool, bpy.types.Operator):
    """Gather guides at the start of a curve and lead them along it: a ponytail, a braid, a rope or a bun"""

    bl_idname = "vellus.gather_guides"
    bl_label = "Gather"
    Settings = GatherSettings
    __annotations__ = setting_properties.annotations(GatherSettings)

    def invoke(self, context, event):
        """Gather at the other selected curve or at the ties that were drawn, or open a dialog to pick a curve."""
        others = [o for o in context.selected_objects if o.type == "CURVE" and o != context.object]
        if len(others) == 1:
            self.line = others[0].name
        self._take_drawn(guides_of(context.object))
        if not self.line and not bpy.app.background:
            self.prefill(guides_of(context.object))
            return context.window_manager.invoke_props_dialog(self)
        return super().invoke(context, event)

    def prefill(self, guides):
        size = guide_tools.surface_size(guides)
        for name in _GATHERED:
            if size and not self.properties.is_property_set(name):
                setattr(self, name, getattr(self, name) * size / _HEAD)

    def change(self, context):
        """Gather at the ties that were drawn, if no curve is picked."""
        self._take_drawn(guides_of(context.object))
        return super().change(context)

    def _take_drawn(self, guides):
        drawn = line_drawing.tie_of(guides)
        if drawn is not None and not self.line:
            self.line = drawn.name

    def apply(self, guides, settings, depsgraph):
        return gathered_guides.gather(guides, settings, depsgraph)

    def message(self, count):
        return "{count} guides gathered", {"count": count}

    def draw_settings(self, layout):
        for name in ("line", "shape", *_ROWS_OF_SHAPES[self.shape], "tightness", "clearance"):
            setting_rows.row(layout, self.properties, name)


_PART = 0.02  # default clearance as a fraction of the guides' length, which fits a surface of any size


class VELLUS_OT_attract_guides(GuideTool, bpy.types.Operator):
    """Turn guides toward the surface and keep them above it; lengths are kept"""

    bl_idname = "vellus.attract_guides"
    bl_label = "Attract Guides"
    Settings = AttractSettings
    __annotations__ = setting_properties.annotations(AttractSettings)

    def prefill(self, guides):
        if not self.properties.is_property_set("clearance"):
            self.clearance = _PART * guide_tools.median_length(guides)

    def message(self, count):
        if not count and not self.amount:
            return "No guides changed: the amount is 0", {}
        return super().message(count)

    def apply(self, guides, settings, depsgraph):
        return guide_tools.attract(guides, settings, depsgraph)


class VELLUS_OT_drape_guides(LongOperator, GuideTool, bpy.types.Operator):
    """Let guides fall under gravity until they rest on the surface, and keep the resulting shape"""

    bl_idname = "vellus.drape_guides"
    bl_label = "Drape Guides"
    Settings = DrapeSettings
    __annotations__ = setting_properties.annotations(DrapeSettings)

    def seconds(self, context):
        surface = surface_of(context.object)
        face_count = 0 if surface is None else scene.triangle_count(surface, context.view_layer)
        return guide_draping.seconds(guides_of(context.object), self._settings(), face_count)

    def work(self, context):
        depsgraph = context.evaluated_depsgraph_get()
        return guide_draping.draping(guides_of(context.object), self._settings(), depsgraph)

    def message(self, made):
        return GuideTool.message(self, made)

    def _settings(self):
        return setting_properties.to_settings(self, DrapeSettings)


CLASSES = (
    VELLUS_OT_guide_length,
    VELLUS_OT_trim_guides,
    VELLUS_OT_change_guide_count,
    VELLUS_OT_mirror_guides,
    VELLUS_OT_copy_guide_shape,
    VELLUS_OT_smooth_guides,
    VELLUS_OT_lift_guides,
    VELLUS_OT_attract_guides,
    VELLUS_OT_drape_guides,
    VELLUS_OT_push_outside,
    VELLUS_OT_gather_guides,
)
