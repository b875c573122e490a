# SPDX-License-Identifier: GPL-3.0-or-later
"""Ramps: curves of a setting from root to tip, edited in Blender's curve widget.

Scripts cannot declare a curve, but a hidden node group can hold a *Float Curve* node.
"""

import hashlib

import bpy
import numpy as np

SAMPLES = 256
_NODE = "Course"


def new_ramp(name, end):
    """A new node group whose curve decreases linearly from 1 at the root to `end` at the tip."""
    tree = bpy.data.node_groups.new(f".{name}", "ShaderNodeTree")  # the dot hides it in lists
    node = tree.nodes.new("ShaderNodeFloatCurve")
    node.name = _NODE
    points = node.mapping.curves[0].points
    points[0].location, points[-1].location = (0.0, 1.0), (1.0, end)
    for point in points:
        point.handle_type = "VECTOR"
    node.mapping.update()
    return tree


def node_of(tree):
    """The node with the curve of a node group; None if it was removed."""
    node = None if tree is None else tree.nodes.get(_NODE)
    return node if node is not None and node.bl_idname == "ShaderNodeFloatCurve" else None


def samples(tree) -> np.ndarray | None:
    """(`SAMPLES`,) float32 values of the curve from root to tip, in [0, 1]; None without a curve."""
    node = node_of(tree)
    if node is None:
        return None
    mapping = node.mapping
    mapping.initialize()
    curve = mapping.curves[0]
    values = np.array([mapping.evaluate(curve, float(place)) for place in np.linspace(0.0, 1.0, SAMPLES)], np.float32)
    return np.clip(np.where(np.isfinite(values), values, np.float32(0.0)), np.float32(0.0), np.float32(1.0))


def digest(tree):
    """Everything that the curve depends on, as text; empty without a curve."""
    node = node_of(tree)
    if node is None:
        return ""
    points = [(*point.location, point.handle_type) for point in node.mapping.curves[0].points]
    return hashlib.sha1(repr((points, node.mapping.extend)).encode(), usedforsecurity=False).hexdigest()
