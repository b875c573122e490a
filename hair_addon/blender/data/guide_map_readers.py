# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether nodes of geometry or materials read the guide weights of strands, whose attributes they name by strings.

Only the beginning of a string is compared, as nodes may append a slot's number.
"""

import bpy

from ..host.caches import Cache

_BEGINNINGS = ("guide_index", "guide_weight")
_PROPERTIES = ("attribute_name", "string")  # properties of nodes, besides input sockets

# session_uid of a node group or material → "read" or "unread"; `changed` drops values whose nodes may have changed.
reading_cache = Cache()


def are_read(hair):
    """Whether nodes, or inputs of modifiers, read the guide weights of hair Curves."""
    users = [user for user in bpy.data.objects if user.data == hair]
    modifiers = [
        modifier
        for user in users
        for modifier in user.modifiers
        if modifier.type == "NODES" and modifier.node_group is not None  # no inputs without a group
    ]
    if any(map(_has_input, modifiers)):
        return True
    trees = [(group.session_uid, group) for group in bpy.data.node_groups]
    trees += [(m.session_uid, m.node_tree) for m in bpy.data.materials if m.node_tree is not None]
    return any(reading_cache.get(uid, lambda tree=tree: _reading_of(tree)) == "read" for uid, tree in trees)


def changed(datablock):
    """Drop the value of a reported material or node tree, or all values if it is None or belongs to no material."""
    if datablock is not None and datablock.is_embedded_data:
        datablock = next((m for m in bpy.data.materials if m.node_tree == datablock), None)
    if datablock is None:
        reading_cache.clear()
    else:
        reading_cache.invalidate(datablock.session_uid)


def _has_input(modifier):
    """Whether a modifier's inputs contain the name of a guide weight attribute."""
    inputs = modifier.properties.inputs
    names = [p.identifier for p in inputs.bl_rna.properties if p.type == "POINTER"]
    sockets = [getattr(inputs, name) for name in names]
    return any(_is_named(getattr(socket, name, None)) for socket in sockets for name in ("value", "attribute_name"))


def _reading_of(tree):
    return "read" if any(map(_names, tree.nodes)) else "unread"


def _names(node):
    values = [getattr(node, name, None) for name in _PROPERTIES]
    values += [socket.default_value for socket in node.inputs if socket.type == "STRING"]
    return any(map(_is_named, values))


def _is_named(value):
    return isinstance(value, str) and value.startswith(_BEGINNINGS)
