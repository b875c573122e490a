# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of a tree that contribute to its result: links lead from them to an output."""

import bpy

_VIEWERS = (bpy.types.CompositorNodeViewer, bpy.types.GeometryNodeViewer)


def images(owner):
    """Return (image, node) of the nodes with an image that contribute to the result of a node tree, or of its
    owner's tree.
    """
    tree = owner if isinstance(owner, bpy.types.NodeTree) else owner.node_tree
    if tree is None:
        return []
    found = []
    for node in _live(tree):
        sources = [getattr(node, "image", None)]
        sources += [getattr(socket, "default_value", None) for socket in node.inputs if socket.type == "IMAGE"]
        found += [(image, node) for image in sources if isinstance(image, bpy.types.Image)]
    return found


def light_profiles(owner):
    """Return the paths, as in the .blend, of the IES profiles that contribute to the result of a node tree, or of its
    owner's tree.
    """
    tree = owner if isinstance(owner, bpy.types.NodeTree) else owner.node_tree
    nodes = [] if tree is None else [node for node in _live(tree) if node.type == "TEX_IES"]
    return [node.filepath for node in nodes if node.mode == "EXTERNAL" and node.filepath]


def _live(tree):
    """Return the nodes from which links lead to an output node other than a viewer; muted nodes are left out."""
    before = {}
    for link in tree.links:
        if not link.is_muted:
            before.setdefault(link.to_node, []).append(link.from_node)
    left = [node for node in tree.nodes if not len(node.outputs) and not isinstance(node, _VIEWERS)]
    live = dict.fromkeys(left)
    while left:
        for node in before.get(left.pop(), ()):
            if node not in live:
                live[node] = None
                left.append(node)
    return [node for node in live if not node.mute]
