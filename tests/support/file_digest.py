# SPDX-License-Identifier: GPL-3.0-or-later
"""Description of the open file, to check that an operation does not change it."""

import hashlib

import bpy
import numpy as np

# Data of Blender's windows, and data that Blender creates itself.
_NOT_COMPARED = {"all_ids", "libraries", "screens", "window_managers", "workspaces", "brushes", "palettes"}


def of_file():
    """Return {(kind, name): description} of all datablocks, and of what is active and selected."""
    found = {}
    for kind in (p.identifier for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"):
        for one in getattr(bpy.data, kind) if kind not in _NOT_COMPARED else ():
            found[kind, one.name] = _described(one)
    layer = bpy.context.view_layer
    active = layer.objects.active
    found["active"] = active and (active.name, active.mode)
    found["selected"] = sorted(one.name for one in layer.objects if one.select_get())
    return found


def changes(before, after):
    """Return the differences {path of keys: (before, after)} as text for an assertion."""
    found = {}
    for key in {*before, *after}:
        pair = before.get(key), after.get(key)
        if all(isinstance(one, dict) for one in pair):
            found |= {f"{key} {path}": inner for path, inner in changes(*pair).items()}
        elif pair[0] != pair[1]:
            found[str(key)] = tuple(one if not isinstance(one, dict) else "there" for one in pair)
    return found


def _described(one):
    kinds = ((bpy.types.Object, _object), (bpy.types.Scene, _scene), (bpy.types.Collection, _collection))
    found = next((describe(one) for kind, describe in kinds if isinstance(one, kind)), {})
    if isinstance(one, bpy.types.Mesh | bpy.types.Curves):
        found = {
            "attributes": {a.name: (a.data_type, a.domain, _values(a)) for a in one.attributes},
            "materials": [m and m.name for m in one.materials],
        }
    if isinstance(one, bpy.types.Curves):
        found["surface"] = one.surface and one.surface.name
    if getattr(one, "node_tree", None) is not None:
        found["nodes"] = sorted(node.name for node in one.node_tree.nodes)
    if isinstance(one, bpy.types.NodeTree):
        found["nodes"] = sorted(node.name for node in one.nodes)
    state = getattr(one, "vellus", None)
    return found if state is None else found | {"vellus": _properties(state)}


def _object(one):
    groups = {}
    if one.type == "MESH":
        for group in one.vertex_groups:
            weights = [g.weight for v in one.data.vertices for g in v.groups if g.group == group.index]
            groups[group.name] = _hash(np.array(weights, np.float32))
    return {
        "type": one.type,
        "data": one.data and one.data.name,
        "parent": one.parent and one.parent.name,
        "matrix": [round(x, 6) for row in one.matrix_world for x in row],
        "modifiers": [(m.name, m.type, m.show_viewport, m.show_render) for m in one.modifiers],
        "groups": groups,
        "active_group": one.vertex_groups.active_index if one.vertex_groups else None,
        "rest": one.add_rest_position_attribute,
        "rays": (one.visible_camera, one.visible_shadow),
        "keys": sorted(one.keys()),
        "collections": sorted(c.name for c in one.users_collection),
        "constraints": [c.enabled for c in one.constraints],
    }


def _scene(one):
    group = one.compositing_node_group
    return {
        "hair_type": one.render.hair_type,
        "keys": sorted(one.keys()),
        "compositing": (one.render.use_compositing, group and group.name),
        "objects": sorted(o.name for o in one.objects),
        "frame": one.frame_current,
    }


def _collection(one):
    return {"objects": sorted(o.name for o in one.objects), "children": sorted(c.name for c in one.children)}


def _values(attribute):
    name = {"FLOAT_VECTOR": "vector", "FLOAT2": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}
    name = name.get(attribute.data_type, "value")
    if not len(attribute.data) or not hasattr(attribute.data[0], name):
        return len(attribute.data)
    first = getattr(attribute.data[0], name)
    width = len(first) if hasattr(first, "__len__") else 1
    whole = attribute.data_type in {"INT", "INT8", "BOOLEAN"}
    values = np.empty(len(attribute.data) * width, np.int32 if whole else np.float32)
    if attribute.data_type == "BOOLEAN":
        values = np.empty(len(attribute.data), bool)
    attribute.data.foreach_get(name, values)
    return _hash(values)


def _hash(values):
    return hashlib.blake2b(values.tobytes(), digest_size=8).hexdigest()


def _properties(group):
    found = {}
    for prop in group.bl_rna.properties:
        if prop.identifier in {"rna_type", "name"}:
            continue
        value = getattr(group, prop.identifier)
        if prop.type == "COLLECTION":
            value = [_properties(item) | {"name": item.name} for item in value]
        elif prop.type == "POINTER":
            is_group = isinstance(value, bpy.types.PropertyGroup)
            value = _properties(value) if is_group else value and value.name
        elif getattr(prop, "is_array", False):
            value = list(value)
        found[prop.identifier] = value
    return found
