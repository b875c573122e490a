# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools of the toolbar: Paint Flow, in Object Mode and Sculpt Mode."""

import bpy

from . import brush_circle, setting_rows

_OPERATOR, _SIZE = "vellus.paint_flow", "vellus.size_flow_brush"
PAINT_FLOW = "vellus.paint_flow"
MODES = ("OBJECT", "SCULPT_CURVES")


def _draw_settings(_context, layout, tool):
    """Draw the settings of the brush in the header, and in the panel of the active tool."""
    settings = tool.operator_properties(_OPERATOR)
    for name in ("radius", "strength", "lift", "mirrored"):
        setting_rows.row(layout, settings, name)


def _draw_cursor(context, tool, xy):
    """Draw the brush below the mouse."""
    brush_circle.draw(context, tool.operator_properties(_OPERATOR), xy)


def _tool(mode):
    """Return the class of the tool for a mode, as each mode has its own toolbar."""
    members = {
        "__doc__": "Turn guides toward the direction of strokes on the surface",
        "bl_space_type": "VIEW_3D",
        "bl_context_mode": mode,
        "bl_idname": PAINT_FLOW,
        "bl_label": "Paint Flow",
        "bl_icon": "brush.particle.comb",
        "bl_cursor": "CROSSHAIR",
        "bl_operator": _OPERATOR,
        "bl_keymap": (
            (_OPERATOR, {"type": "LEFTMOUSE", "value": "PRESS"}, None),
            (_SIZE, {"type": "F", "value": "PRESS"}, {"properties": [("setting", "radius")]}),
            (_SIZE, {"type": "F", "value": "PRESS", "shift": True}, {"properties": [("setting", "strength")]}),
        ),
        "draw_settings": staticmethod(_draw_settings),
        "draw_cursor": staticmethod(_draw_cursor),
    }
    return type(f"VELLUS_TOOL_paint_flow_{mode.lower()}", (bpy.types.WorkSpaceTool,), members)


TOOLS = tuple(_tool(mode) for mode in MODES)


def draw_paint_flow(layout, context):
    """Draw the button that makes Paint Flow the active tool, in modes that have it."""
    if context.mode in MODES:
        layout.operator("wm.tool_set_by_id", text="Paint Flow", icon="BRUSHES_ALL").name = PAINT_FLOW


def register():
    """Add the tools to the toolbars."""
    for tool in TOOLS:
        bpy.utils.register_tool(tool, separator=True)


def unregister():
    """Remove the tools."""
    for tool in TOOLS:
        bpy.utils.unregister_tool(tool)
