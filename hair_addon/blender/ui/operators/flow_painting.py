# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator of the Paint Flow tool: a stroke of the mouse turns the guides near it."""

import bpy
import numpy as np
from bpy_extras import view3d_utils

from ....core.errors import HairError, memory_as_sentence
from ....core.grooming.guide_tool_settings import FlowSettings
from ...groom.guides import flow_painting, guide_tools
from ...groom.selection import guides_of
from ...settings import setting_properties, strokes
from .guide_tools import GuideTool

_TOOL = "vellus.paint_flow"
_PART = 0.12  # default radius as a fraction of the size of the surface
_SPACING = 0.05  # least distance between points of a stroke, relative to the radius


class VELLUS_OT_paint_flow(GuideTool, bpy.types.Operator):
    """Drag over the surface to turn guides along the stroke; roots and lengths are kept"""

    bl_idname = "vellus.paint_flow"
    bl_label = "Paint Flow"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}
    Settings = FlowSettings
    __annotations__ = setting_properties.annotations(FlowSettings) | strokes.annotations()

    def prefill(self, guides):
        size = guide_tools.surface_size(guides)
        if size and not self.properties.is_property_set("radius"):
            self.radius = _PART * size

    def invoke(self, context, event):
        """Begin a stroke where the mouse is pressed on the surface; elsewhere Blender handles the event."""
        guides = guides_of(context.object)
        self._surface = guides.surface
        place = self._place_of(context, event)
        if place is None:
            return {"PASS_THROUGH"}
        self.prefill(guides)
        tool = context.workspace.tools.from_space_view3d_mode(context.mode)
        if tool is not None and tool.idname == _TOOL:
            tool.operator_properties(_TOOL).radius = self.radius  # shown in the header
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
        if self._surface is None or region is None or view is None:
            return None
        mouse = event.mouse_region_x, event.mouse_region_y
        origin = view3d_utils.region_2d_to_origin_3d(region, view, mouse)
        direction = view3d_utils.region_2d_to_vector_3d(region, view, mouse)
        return flow_painting.place_on(self._surface, origin, direction, context.evaluated_depsgraph_get())


CLASSES = (VELLUS_OT_paint_flow,)
