# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator of the Paint Flow tool: a stroke of the mouse turns the guides near it."""

import bpy
import numpy as np
from bpy_extras import view3d_utils

from ....core.errors import HairError, memory_as_sentence
from ....core.grooming.guide_tool_settings import FlowSettings
from ...groom.guides import flow_painting
from ...groom.selection import guides_of
from ...host.notices import name_of
from ...settings import setting_properties, strokes
from ...settings.translations import CONTEXT
from .. import brush_circle
from .guide_tools import GuideTool

_TOOL = "vellus.paint_flow"
_SPACING = 0.05  # least distance between points of a stroke, relative to the radius
_OCTAVE = 150.0  # movement of the mouse that doubles the radius [pixels]
_RANGE = 300.0  # movement of the mouse from no strength to full strength [pixels]


def _fitted_radius():
    """Return the radius of the brush [m] that fits the surface of the active guides, or None."""
    guides = guides_of(getattr(bpy.context, "object", None))
    return None if guides is None else flow_painting.default_radius(guides)


class VELLUS_OT_paint_flow(GuideTool, bpy.types.Operator):
    """Turn guides toward the direction of strokes on the surface, keeping roots and lengths"""

    bl_idname = "vellus.paint_flow"
    bl_label = "Paint Flow"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}
    Settings = FlowSettings
    __annotations__ = setting_properties.annotations(FlowSettings) | strokes.annotations(_fitted_radius)

    def invoke(self, context, event):
        """Begin a stroke where the mouse is pressed on the surface; elsewhere Blender handles the event."""
        guides = guides_of(context.object)
        self._surface = guides.surface
        if self._surface is None:
            return self.refuse(HairError('"{name}" has no surface: attach the guides to a mesh.', name=name_of(guides)))
        place = self._place_of(context, event)
        if place is None:
            return {"PASS_THROUGH"}
        self.radius = radius = self.radius  # stored, so that the redo panel repeats the stroke with it
        tool = _active_tool(context)
        if tool is not None:
            tool.operator_properties(_TOOL).radius = radius
        self.stroke.clear()
        try:
            with memory_as_sentence():
                settings = setting_properties.to_settings(self, FlowSettings)
                self._painted = flow_painting.FlowStroke(guides, settings, context.evaluated_depsgraph_get())
        except HairError as error:
            return self.refuse(error)
        self._extend(place)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Turn guides while the mouse moves; Esc and the right button cancel the stroke."""
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self._painted.restore()
            return {"CANCELLED"}
        try:
            if event.type == "MOUSEMOVE":
                self._follow(context, event)
        except HairError as error:
            self._painted.restore()
            return self.refuse(error)
        if event.type == "LEFTMOUSE" and event.value == "RELEASE":
            return {"FINISHED"} if len(self.stroke) > 1 else {"CANCELLED"}
        return {"RUNNING_MODAL"}

    def cancel(self, _context):
        """Undo the stroke when the window is closed."""
        self._painted.restore()

    def apply(self, guides, settings, depsgraph):
        return flow_painting.paint(guides, strokes.read(self), settings, depsgraph)

    def _follow(self, context, event):
        place = self._place_of(context, event)
        if place is None:
            return
        step = (place - self._last) @ np.array(self._surface.matrix_world.to_3x3()).T
        if np.linalg.norm(step) >= _SPACING * self.radius:
            self._extend(place)

    def _extend(self, place):
        strokes.add(self, place)
        self._last = strokes.read(self)[-1]
        self._painted.extend(self._last)

    def _place_of(self, context, event):
        """Return the place (3,) on the surface below the mouse, in its local coordinates, or None."""
        region, view = context.region, context.region_data
        if region is None or view is None:
            return None
        mouse = event.mouse_region_x, event.mouse_region_y
        origin = view3d_utils.region_2d_to_origin_3d(region, view, mouse)
        direction = view3d_utils.region_2d_to_vector_3d(region, view, mouse)
        return flow_painting.place_on(self._surface, origin, direction, context.evaluated_depsgraph_get())


class VELLUS_OT_size_flow_brush(bpy.types.Operator):
    """Change the radius or strength of the Paint Flow brush by moving the mouse sideways"""

    bl_idname = "vellus.size_flow_brush"
    bl_label = "Size Flow Brush"
    bl_options = {"REGISTER", "INTERNAL", "BLOCKING"}
    bl_translation_context = CONTEXT
    __annotations__ = strokes.brush_annotations()

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Choose the tool Paint Flow in a 3D viewport.")
        return context.region_data is not None and _active_tool(context) is not None

    def invoke(self, context, event):
        """Begin with the present value."""
        brush = _active_tool(context).operator_properties(_TOOL)
        self._brush, self._before, self._start = brush, getattr(brush, self.setting), (event.mouse_x, event.mouse_y)
        self._was_set = brush.is_property_set(self.setting)
        brush_circle.hold(self._start)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Change the value while the mouse moves; Esc and the right button restore it."""
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self._restore()
            return self._end(context, {"CANCELLED"})
        if event.type in {"LEFTMOUSE", "RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            return self._end(context, {"FINISHED"})
        if event.type == "MOUSEMOVE":
            moved = (event.mouse_x - self._start[0]) / context.preferences.system.ui_scale
            is_radius = self.setting == "radius"
            value = self._before * 2.0 ** (moved / _OCTAVE) if is_radius else self._before + moved / _RANGE
            setattr(self._brush, self.setting, value)
            context.area.tag_redraw()  # the circle, and the header with the value
        return {"RUNNING_MODAL"}

    def cancel(self, _context):
        """Restore the value when the window is closed."""
        brush_circle.hold(None)
        self._restore()

    def _restore(self):
        """Restore the value; a radius that was not set fits the surface again."""
        if self._was_set:
            setattr(self._brush, self.setting, self._before)
        else:
            self._brush.property_unset(self.setting)

    def _end(self, context, result):
        brush_circle.hold(None)
        context.window.cursor_warp(*self._start)  # back to the circle
        context.area.tag_redraw()
        return result


def _active_tool(context):
    """Return the active tool if it is Paint Flow, else None."""
    tool = context.workspace.tools.from_space_view3d_mode(context.mode)
    return tool if tool is not None and tool.idname == _TOOL else None


CLASSES = (VELLUS_OT_paint_flow, VELLUS_OT_size_flow_brush)
