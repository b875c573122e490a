# SPDX-License-Identifier: GPL-3.0-or-later
"""Ramps as nodes of hidden node groups: scripts cannot declare a curve, and nodes have Blender's own widgets."""

import bpy

from ...core.maps import ramp_text
from ..host.notices import name_of
from .setting_properties import shortest

_NODE = "Course"
_IDENTIFIERS = {"ShaderNodeFloatCurve", "ShaderNodeValToRGB"}


def node_of(tree: bpy.types.NodeTree | None):
    """Return the node with the curve or color ramp of a node group; None if it was removed."""
    node = None if tree is None else tree.nodes.get(_NODE)
    return node if node is not None and node.bl_idname in _IDENTIFIERS else None


def is_color(node) -> bool:
    """Return whether a node is a color ramp."""
    return node.bl_idname == "ShaderNodeValToRGB"


def new_tree(name: str, text: str) -> bpy.types.NodeTree:
    """Add a node group with a ramp that is given as text. Raises `HairError` before anything changes."""
    ramp = ramp_text.parsed(text)
    tree = bpy.data.node_groups.new(f".{name}", "ShaderNodeTree")  # the dot hides it in lists
    is_curve = isinstance(ramp, ramp_text.Curve)
    node = tree.nodes.new("ShaderNodeFloatCurve" if is_curve else "ShaderNodeValToRGB")
    node.name = _NODE
    if is_curve:
        _set_curve(node.mapping, ramp)
    else:
        _set_colors(node.color_ramp, ramp)
    return tree


def _set_curve(mapping, ramp):
    points = mapping.curves[0].points
    for position, _value, _handle in ramp.points[2:]:
        points.new(position, 0.0)
    for point, (position, value, handle) in zip(points, ramp.points, strict=True):
        point.location, point.handle_type = (position, value), handle.upper()
    mapping.extend = ramp.extend.upper()
    mapping.update()


def _set_colors(colors, ramp):
    elements = colors.elements
    for _ in ramp.stops[len(elements) :]:
        elements.new(1.0)
    for _ in elements[len(ramp.stops) :]:
        elements.remove(elements[-1])
    colors.color_mode = ramp.mode.upper()
    colors.interpolation, colors.hue_interpolation = ramp.interpolation.upper(), ramp.hue.upper()
    for element, (position, color) in zip(elements, ramp.stops, strict=True):
        element.position, element.color = position, color


def text_of(tree: bpy.types.NodeTree | None) -> str:
    """Return the ramp of a node group as text, limited to values from 0 to 1; empty without a ramp."""
    node = node_of(tree)
    if node is None:
        return ""
    if is_color(node):
        ramp = node.color_ramp
        stops = [(_part(each.position), tuple(map(_part, each.color))) for each in ramp.elements]
        return ramp_text.Colors(
            tuple(sorted(stops)), ramp.interpolation.lower(), ramp.color_mode.lower(), ramp.hue_interpolation.lower()
        ).text()
    points = []
    for point in node.mapping.curves[0].points:
        handle = point.handle_type.lower()
        handle = handle if handle in ramp_text.HANDLES else "auto"
        points.append((*map(_part, point.location), handle))
    return ramp_text.Curve(tuple(sorted(points)), node.mapping.extend.lower()).text()


def copy_colors(tree: bpy.types.NodeTree, shown: bpy.types.NodeTree) -> None:
    """Copy the color ramp of the evaluated node group `shown` stop by stop, as keyframes refer to stops by index."""
    to, source = node_of(tree), node_of(shown)
    if to is None or source is None or not is_color(to):
        return
    for name in ("color_mode", "interpolation", "hue_interpolation"):
        setattr(to.color_ramp, name, getattr(source.color_ramp, name))
    for stop, of_frame in zip(to.color_ramp.elements, source.color_ramp.elements, strict=True):
        stop.position, stop.color = of_frame.position, of_frame.color


def _part(value):
    # Written so that NaN becomes 0.
    return shortest(min(value, 1.0)) if value > 0.0 else 0.0


def replaced(tree: bpy.types.NodeTree | None, owner: bpy.types.ID, label: str, text: str) -> bpy.types.NodeTree | None:
    """Return a node group with the ramp of a text, None for an empty text: the present one if it has this ramp.

    owner, label: name a new node group.
    """
    if text == text_of(tree) and (tree is None) == (text == ""):
        return tree
    return new_tree(f"{name_of(owner)} {label}", text) if text else None


def remove_unused(tree: bpy.types.NodeTree | None) -> None:
    """Delete a node group that nothing uses any more."""
    if tree is not None and tree.users == 0 and tree.library is None:
        bpy.data.node_groups.remove(tree)
