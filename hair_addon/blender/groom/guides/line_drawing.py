# SPDX-License-Identifier: GPL-3.0-or-later
"""Part lines, flow lines and the curves of ties, drawn with Blender's Draw tool."""

import bpy
from bpy.types import Context, Curves, Object

from ....core.errors import HairError
from ...data import surface_collections
from ...data.strands import curves
from ...host.notices import name_of, text_of
from .. import selection
from . import guide_states

# Settings of the Draw tool: exact corners, on the surface only. A Bézier curve would cut through the surface.
_TOOL = {
    "curve_type": "POLY",
    "depth_mode": "SURFACE",
    "surface_offset": 0.0,
    "use_offset_absolute": True,
    "use_stroke_endpoints": False,
    "use_project_only_selected": True,
    "error_threshold": 1,
}


# The line of a tie begins on the surface and leaves it at the depth of its start.
_OFF_SURFACE = {"use_stroke_endpoints": True, "surface_plane": "NORMAL_VIEW"}


def drawn_for(active: Object | None) -> Curves | None:
    """Return the Curves whose part lines, flow lines or ties are the active object in Edit Mode; None otherwise."""
    if active is None or active.type != "CURVE" or active.mode != "EDIT":
        return None
    users = (datablock for datablock in bpy.data.hair_curves if active.name in _names_of(datablock))
    return next(users, None)


def draw_parting(hair: Curves, context: Context) -> None:
    """Start drawing part lines of hair, or continue existing ones. Raises `HairError`."""
    _begin(hair, hair.vellus.hair, "part_lines", "Parting", context)


def draw_flow(guides: Curves, context: Context) -> None:
    """Start drawing flow lines of guides, or continue existing ones. Raises `HairError`."""
    if guide_states.of(guides).is_combed:
        raise HairError("Combed guides do not follow flow lines: regenerate the guides first, or comb them.")
    _begin(guides, guides.vellus.guides, "flow_lines", "Flow", context)


def draw_tie(guides: Curves, context: Context) -> None:
    """Start drawing the curves that gather guides, or continue existing ones. Raises `HairError`.

    No panel shows the name of these curves, so new ones are begun if they were converted or are not in this view layer.
    """
    curves.require_editable(guides)
    tie = tie_of(guides)
    if tie is None or not selection.is_in(tie, context.view_layer):
        guides.vellus.tie_lines = ""
    _begin(guides, guides.vellus, "tie_lines", "Tie", context)
    for name, value in _OFF_SURFACE.items():
        setattr(context.tool_settings.curve_paint_settings, name, value)


def tie_of(guides: Curves) -> Object | None:
    """Return the curve object of the ties that were drawn for guides; None if there is none."""
    found = bpy.data.objects.get(text_of(guides.vellus, "tie_lines"))
    return found if found is not None and found.type == "CURVE" else None


def stop(context: Context) -> None:
    """Leave Edit Mode and make the hair or guides of the lines active. Lines without a stroke are removed."""
    lines = context.object
    target = drawn_for(lines)
    bpy.ops.object.mode_set(mode="OBJECT")
    shown = selection.object_of(target, context.view_layer)
    if not len(lines.data.splines):
        for group, name in _fields_of(target):
            if text_of(group, name) == lines.name:
                setattr(group, name, "")
        bpy.data.curves.remove(lines.data)
    if shown is not None:
        selection.make_active(shown, context.view_layer)


def _begin(target, group, field, title, context):
    surface = target.surface
    curves.require_editable(target)
    if surface is None or not selection.is_in(surface, context.view_layer):
        raise HairError("The surface is missing: pick a mesh.")
    lines = bpy.data.objects.get(text_of(group, field))
    if lines is not None and lines.type != "CURVE":
        sentence = '"{name}" is not a curve that can be drawn on: clear the field to draw new lines.'
        raise HairError(sentence, name=name_of(lines))
    if lines is not None and not selection.is_in(lines, context.view_layer):
        raise HairError('"{name}" is not in this view layer: include one of its collections.', name=name_of(lines))
    if lines is None:
        lines = _new_lines(f"{title} of {surface.name}", surface)
    if context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    is_viewport = context.area is not None and context.area.type == "VIEW_3D"
    selection.reveal(lines, context.view_layer, context.space_data if is_viewport else None)
    selection.make_active(lines, context.view_layer)
    surface.select_set(True)  # the tool draws on selected objects
    bpy.ops.object.mode_set(mode="EDIT")
    setattr(group, field, lines.name)
    paint = context.tool_settings.curve_paint_settings
    for name, value in _TOOL.items():
        setattr(paint, name, value)
    if is_viewport:
        bpy.ops.wm.tool_set_by_id(name="builtin.draw", space_type="VIEW_3D")


def _new_lines(name, surface):
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions = "3D"
    lines = bpy.data.objects.new(name, data)
    surface_collections.collection_of(surface).objects.link(lines)
    lines.parent = surface  # lines use its coordinates and move with it
    lines.show_in_front, lines.hide_render = True, True
    return lines


def _fields_of(datablock):
    state = datablock.vellus
    if state.kind == "HAIR":
        return ((state.hair, "part_lines"),)
    return (state.guides, "flow_lines"), (state, "tie_lines")


def _names_of(datablock):
    return [text_of(group, name) for group, name in _fields_of(datablock)] if datablock.vellus.kind != "NONE" else []
