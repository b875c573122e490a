# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether nodes of geometry or materials read the guide weights of strands, whose attributes they name by strings.

Only the beginning of a string is compared, as nodes may append a slot's number.
"""

import bpy

from ..host.caches import Cache

_BEGINNINGS = ("guide_index", "guide_weight")
_PROPERTIES = ("attribute_name", "string")  # properties of nodes, besides input sockets

# `_key` → "read" or "unread"; cleared when nodes change by `stored_guide_maps.follow`.
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
    return reading_cache.get(_key(modifiers), lambda: "read" if _are_in_nodes() else "unread") == "read"


def _key(modifiers):
    groups = (modifier.node_group.session_uid for modifier in modifiers)
    return len(bpy.data.node_groups), len(bpy.data.materials), *groups


def _has_input(modifier):
    """Whether a modifier's inputs contain the name of a guide weight attribute."""
    inputs = modifier.properties.inputs
    names = [p.identifier for p in inputs.bl_rna.properties if p.type == "POINTER"]
    sockets = [getattr(inputs, name) for name in names]
    return any(_is_named(getattr(socket, name, None)) for socket in sockets for name in ("value", "attribute_name"))


def _are_in_nodes():
    trees = [*bpy.data.node_groups, *(m.node_tree for m in bpy.data.materials if m.node_tree is not None)]
    return any(_names(node) for tree in trees for node in tree.nodes)


def _names(node):
    values = [getattr(node, name, None) for name in _PROPERTIES]
    values += [socket.default_value for socket in node.inputs if socket.type == "STRING"]
    return any(map(_is_named, values))


def _is_named(value):
    return isinstance(value, str) and value.startswith(_BEGINNINGS)
