# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes of hair that is wet in places: a second hair node, mixed with the first by the wetness of each strand.

The mix is the same as in the viewport: `appearance.wet_share` of the same attribute.
"""

from . import node_values

_PREFIX = "Wet Places "  # of the names of our nodes, which identifies them

_HAIR = "Hair"  # the node of the wettest look

# Name: (type, {property: value}, location relative to the driest hair node, label).
_NODES = {
    "Wetness": ("ShaderNodeAttribute", {"attribute_name": "wetness"}, (0, 230), "Wetness"),
    "Share": ("ShaderNodeMapRange", {"interpolation_type": "LINEAR", "clamp": True}, (200, 230), "Share"),
    _HAIR: ("ShaderNodeBsdfHairPrincipled", {"model": "CHIANG", "parametrization": "ABSORPTION"}, (0, -420), "Wet"),
    "Mix": ("ShaderNodeMixShader", {}, (420, 0), "Mix"),
}


def write(tree, hair_node, wetness_range):
    """Mix a Principled Hair node of the driest look with a node of the wettest look, which is returned.

    wetness_range: wetness of the two looks.
    """
    nodes = _ours(tree)
    if set(nodes) != set(_NODES):
        remove(tree, hair_node)
        nodes = _build(tree, hair_node)
    inputs = {socket.identifier: socket for socket in nodes["Share"].inputs}
    for name, value in zip(("From Min", "From Max"), wetness_range, strict=True):
        node_values.assign(inputs[name], "default_value", value)
    return nodes[_HAIR]


def remove(tree, hair_node):
    """Remove the nodes of `write`: all strands have the look of `hair_node`."""
    nodes = _ours(tree)
    if "Mix" in nodes:
        _relink(tree, nodes["Mix"].outputs[0], hair_node.outputs["BSDF"])
    for node in nodes.values():
        tree.nodes.remove(node)


def is_ours(node):
    """Whether a node was added by `write`."""
    return node.name.startswith(_PREFIX)


def _ours(tree):
    return {node.name.removeprefix(_PREFIX): node for node in tree.nodes if is_ours(node)}


def _build(tree, hair_node):
    nodes = {}
    for name, (kind, properties, (x, y), label) in _NODES.items():
        node = nodes[name] = tree.nodes.new(kind)
        node.name, node.label = _PREFIX + name, label
        node.location = (hair_node.location.x + x, hair_node.location.y + y)
        for key, value in properties.items():
            setattr(node, key, value)
    mix = nodes["Mix"]
    _relink(tree, hair_node.outputs["BSDF"], mix.outputs[0])
    tree.links.new(_factor(nodes["Wetness"]), nodes["Share"].inputs["Value"])
    tree.links.new(nodes["Share"].outputs["Result"], mix.inputs[0])
    tree.links.new(hair_node.outputs["BSDF"], mix.inputs[1])
    tree.links.new(nodes[_HAIR].outputs["BSDF"], mix.inputs[2])
    return nodes


def _factor(attribute_node):
    return next(socket for socket in attribute_node.outputs if socket.identifier == "Fac")


def _relink(tree, before, after):
    """Move an output's links, except those to our nodes, to another output."""
    for target in [link.to_socket for link in before.links if not is_ours(link.to_node)]:
        tree.links.new(after, target)
