# SPDX-License-Identifier: GPL-3.0-or-later
"""Rest positions of surfaces whose modifiers replace their geometry, for example by that of another object.

Blender stores rest positions of a mesh before its own modifiers: geometry that nodes take from another object has rest
positions if that object stores them.
"""

import bpy

_REST = "rest_position"


def keep(surface_object):
    """If a surface lacks rest positions, let the objects whose geometry it shows store them.

    Returns whether any of these objects changed.
    """
    # Uses the last evaluation: evaluating here would call handlers, one of which may be the caller.
    if not lacks(surface_object, bpy.context.view_layer.depsgraph):
        return False
    found = [o for o in _sources(surface_object) if o.library is None and not o.add_rest_position_attribute]
    for source in found:
        source.add_rest_position_attribute = True
    return bool(found)


def lacks(surface_object, depsgraph):
    """Whether an evaluated mesh lacks rest positions although its object stores them; no geometry is read."""
    if depsgraph is None or surface_object.mode != "OBJECT" or not surface_object.add_rest_position_attribute:
        return False
    evaluated = surface_object.evaluated_get(depsgraph)
    return evaluated.is_evaluated and len(evaluated.data.vertices) > 0 and _REST not in evaluated.data.attributes


def _sources(surface_object):
    """Return the mesh objects that geometry nodes of a surface use, directly or in collections."""
    named, known = set(), set()
    for modifier in surface_object.modifiers:
        if modifier.type == "NODES" and modifier.node_group is not None:
            for item in modifier.node_group.interface.items_tree:
                if item.item_type == "SOCKET" and item.in_out == "INPUT":
                    socket = getattr(modifier.properties.inputs, item.identifier, None)
                    named.add(getattr(socket, "value", None) if _names_objects(item.socket_type) else None)
            named |= _named_in(modifier.node_group, known)
    collections = [block for block in named if isinstance(block, bpy.types.Collection)]
    objects = {o for collection in collections for o in collection.all_objects} | named
    return [o for o in objects if isinstance(o, bpy.types.Object) and o.type == "MESH" and o != surface_object]


def _named_in(group, known):
    """Objects and collections in sockets of a node group, and in groups within it."""
    known.add(group)
    named = set()
    for node in group.nodes:
        inner = getattr(node, "node_tree", None)
        if inner is not None and inner not in known:
            named |= _named_in(inner, known)
        named |= {socket.default_value for socket in node.inputs if _names_objects(socket.bl_idname)}
    return named


def _names_objects(socket_type):
    return socket_type in {"NodeSocketObject", "NodeSocketCollection"}
