# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading and writing of Blender's data as arrays, independent of the add-on's code."""

import bpy
import numpy as np


def vertex_positions(mesh_object):
    """Return (V, 3) float32 of a mesh object's own vertices."""
    positions = np.empty((len(mesh_object.data.vertices), 3), np.float32)
    mesh_object.data.vertices.foreach_get("co", positions.ravel())
    return positions


def points(curves_object):
    """Return (S, P, 3) float32 in local coordinates."""
    curves = curves_object.data
    positions = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", positions.ravel())
    return positions.reshape(len(curves.curves), -1, 3)


def evaluated_points(curves_object, depsgraph=None):
    """Return (S, P, 3) float32 in local coordinates, as rendered: after the object's modifiers."""
    curves = curves_object.evaluated_get(depsgraph or bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty((len(curves.points), 3), np.float32)
    curves.attributes["position"].data.foreach_get("vector", positions.ravel())
    return positions.reshape(len(curves.curves), -1, 3)


def write_points(curves_object, positions):
    """Move the points of Curves as a brush does, and update."""
    flat = np.ascontiguousarray(positions, np.float32).ravel()
    curves_object.data.attributes["position"].data.foreach_set("vector", flat)
    curves_object.data.update_tag()
    bpy.context.view_layer.update()


def attribute(curves_object, name, width=1):
    """Return (N,) or (N, width) values of a curves attribute."""
    data = curves_object.data.attributes[name].data
    kind = np.int32 if curves_object.data.attributes[name].data_type == "INT" else np.float32
    values = np.empty((len(data), width), kind)
    data.foreach_get("vector" if width > 1 else "value", values.ravel())
    return values if width > 1 else values[:, 0]


def snapshot():
    """Return the names of all data that an operator could leave behind in the file."""
    return {
        "objects": sorted(bpy.data.objects.keys()),
        "curves": sorted(bpy.data.hair_curves.keys()),
        "meshes": sorted(bpy.data.meshes.keys()),
        "materials": sorted(bpy.data.materials.keys()),
        "images": sorted(bpy.data.images.keys()),
    }


def everything():
    """Return {collection: names} of all datablocks except the interface's and the image of Blender's last render."""
    names = (p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION")
    left_out = {"screens", "window_managers", "workspaces", "brushes", "libraries", "all_ids"}
    found = {name: sorted(getattr(bpy.data, name).keys()) for name in names if name not in left_out}
    found["images"] = [name for name in found["images"] if name != "Render Result"]
    return found


def guide_map(datablock):
    """Return (S, k) indices and (S, k) weights of strands' guides from their attributes; None without them."""
    slots = sum(a.name.startswith("guide_index_") for a in datablock.attributes)
    if not slots:
        return None
    indices = np.empty((slots, len(datablock.curves)), np.int32)
    weights = np.empty((slots, len(datablock.curves)), np.float32)
    for slot in range(slots):
        datablock.attributes[f"guide_index_{slot}"].data.foreach_get("value", indices[slot])
        datablock.attributes[f"guide_weight_{slot}"].data.foreach_get("value", weights[slot])
    return indices.T, weights.T


def read_picture(path):
    """Return (values,) of a picture file's pixels."""
    image = bpy.data.images.load(str(path))
    try:
        return np.array(image.pixels[:])
    finally:
        bpy.data.images.remove(image)
