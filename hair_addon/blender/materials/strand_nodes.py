# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes that vary the absorption between and along strands: `strand_variation` in Cycles.

Where maps vary the look, attributes of the hair's Curves have the absorption at root and tip, a factor of the
roughness, and the radial roughness if it varies, so that linked and exported hair keeps its colors. The strand's random
number comes from the same attribute as in the viewport; for strands with evenly spaced points, Hair Info's intercept is
the viewport's position along the strand.
"""

import itertools
import math

from ...core.shading.fibre.pigment import FALLOFF, LEAST_LIGHT, color_falloff
from ..data.maps import strand_maps
from . import node_values

_PREFIX = "Vellus "  # of the names of our nodes, which identifies them

# Name: (type, {property: value}, place in the frame).
_NODES = {
    "Strands": ("NodeFrame", {"label": "Variation between strands"}, (0, 0)),
    "Random": ("ShaderNodeAttribute", {"attribute_name": "strand_random"}, (0, 0)),
    "Position": ("ShaderNodeHairInfo", {}, (0, 2)),
    "Factor": ("ShaderNodeMath", {"operation": "MULTIPLY_ADD"}, (1, 0)),
    "Light": ("ShaderNodeMath", {"operation": "MULTIPLY_ADD"}, (2, 0)),
    "Least Light": ("ShaderNodeMath", {"operation": "MAXIMUM"}, (3, 0)),
    "Concentration": ("ShaderNodeMath", {"operation": "LOGARITHM"}, (4, 0)),
    "Gradient": ("ShaderNodeMapRange", {"interpolation_type": "SMOOTHSTEP"}, (1, 2)),
    "Tip": ("ShaderNodeMath", {"operation": "MULTIPLY_ADD"}, (5, 1)),
    "Pigment": ("ShaderNodeVectorMath", {"operation": "SCALE"}, (5, 0)),
    "Dyed": ("ShaderNodeVectorMath", {"operation": "ADD"}, (6, 0)),
    "Root": ("ShaderNodeVectorMath", {"operation": "SCALE"}, (7, 0)),
    "Tip Dye": ("ShaderNodeVectorMath", {"operation": "SCALE"}, (7, 2)),
    "Absorption": ("ShaderNodeVectorMath", {"operation": "ADD"}, (8, 0)),
    "Square Root": ("ShaderNodeVectorMath", {"operation": "POWER"}, (9, 1)),
    "Falloff": ("ShaderNodeVectorMath", {"operation": "SCALE"}, (10, 1)),
    "Color": ("ShaderNodeVectorMath", {"operation": "POWER"}, (11, 1)),  # for EEVEE
}
# The same with looks of strands by maps.
_MAPPED_NODES = {
    "Strands": ("NodeFrame", {"label": "Looks of strands by maps"}, (0, 0)),
    "Random": ("ShaderNodeAttribute", {"attribute_name": "strand_random"}, (0, 0)),
    "Root": ("ShaderNodeAttribute", {"attribute_name": strand_maps.ROOT}, (0, 1)),
    "Tip": ("ShaderNodeAttribute", {"attribute_name": strand_maps.TIP}, (0, 2)),
    "Position": ("ShaderNodeHairInfo", {}, (0, 3)),
    "Roughness": ("ShaderNodeAttribute", {"attribute_name": strand_maps.ROUGHNESS}, (0, 4)),
    "Gradient": ("ShaderNodeMapRange", {"interpolation_type": "SMOOTHSTEP"}, (1, 3)),
    "Difference": ("ShaderNodeVectorMath", {"operation": "SUBTRACT"}, (1, 2)),
    "Tip Part": ("ShaderNodeVectorMath", {"operation": "SCALE"}, (2, 2)),
    **{name: _NODES[name] for name in ("Absorption", "Square Root", "Falloff", "Color")},
}
# With looks that differ in radial roughness: Horner's scheme of `color_falloff`, the highest power first.
_POWERS = [f"Falloff {power}" for power in range(len(FALLOFF) - 2, -1, -1)]
_RADIAL_NODES = {
    **_MAPPED_NODES,
    "Radial Roughness": ("ShaderNodeAttribute", {"attribute_name": strand_maps.RADIAL}, (0, 5)),
    **{name: ("ShaderNodeMath", {"operation": "MULTIPLY_ADD"}, (2 + column, 5)) for column, name in enumerate(_POWERS)},
}
_SPACING = (180.0, -190.0)

# (node, output, node, input); sockets by index where their names repeat.
_LINKS = (
    ("Random", "Fac", "Factor", 0),
    ("Factor", 0, "Light", 0),
    ("Light", 0, "Least Light", 0),
    ("Least Light", 0, "Concentration", 0),
    ("Position", "Intercept", "Gradient", "Value"),
    ("Gradient", "Result", "Tip", 0),
    ("Gradient", "Result", "Tip Dye", "Scale"),
    ("Pigment", 0, "Dyed", 0),
    ("Dyed", 0, "Root", 0),
    ("Tip", 0, "Root", "Scale"),
    ("Root", 0, "Absorption", 0),
    ("Tip Dye", 0, "Absorption", 1),
    ("Absorption", 0, "Square Root", 0),
    ("Square Root", 0, "Falloff", 0),
    ("Falloff", 0, "Color", 1),
)
_MAPPED_LINKS = (
    ("Position", "Intercept", "Gradient", "Value"),
    ("Tip", "Vector", "Difference", 0),
    ("Root", "Vector", "Difference", 1),
    ("Difference", 0, "Tip Part", 0),
    ("Gradient", "Result", "Tip Part", "Scale"),
    ("Root", "Vector", "Absorption", 0),
    ("Tip Part", 0, "Absorption", 1),
    *_LINKS[-3:],
)
_RADIAL_LINKS = (
    *_MAPPED_LINKS,
    *(("Radial Roughness", "Fac", name, 1) for name in _POWERS),
    *((name, 0, next_name, 0) for name, next_name in itertools.pairwise(_POWERS)),
    (_POWERS[-1], 0, "Falloff", "Scale"),
)
_SCALED = "Scaled Roughness of "  # nodes that multiply the roughness of a hair node, by the name of it


def write(tree, hair_node, variation, falloff, is_mapped=False, is_radial=False):
    """Vary the absorption of a Principled Hair node; returns the output of a color with this falloff, for EEVEE.

    is_mapped: by the looks that the hair's Curves store; is_radial: whether these looks differ in radial roughness.
    """
    nodes = _ours(tree)
    graph = _graph_of(is_mapped, is_radial)
    if {name for name in nodes if not name.startswith(_SCALED)} != set(graph[0]):
        remove(tree)
        nodes = _build(tree, *graph)
        nodes["Strands"].location = (hair_node.location.x - 15 * _SPACING[0], hair_node.location.y)
    for name, inputs in _values(variation, falloff).items():
        if name not in graph[0] or (is_mapped and name == "Tip"):
            continue
        for socket, value in inputs.items():
            node_values.assign(_input(nodes[name], socket), "default_value", value)
    if is_mapped:
        _scale_roughness(tree, hair_node, nodes)
        if is_radial:
            _vary_radial_roughness(tree, hair_node, nodes, falloff)
    else:
        # Pigment without melanin varies directly, not through its concentration.
        _link(
            tree,
            nodes["Concentration" if variation.melanin >= 1e-4 else "Factor"].outputs[0],
            nodes["Pigment"],
            "Scale",
        )
    _link(tree, nodes["Absorption"].outputs[0], hair_node, "Absorption Coefficient")
    _link(tree, _output(nodes["Random"], "Fac"), hair_node, "Random")
    return nodes["Color"].outputs[0]


def _graph_of(is_mapped, is_radial):
    """Return (nodes, links)."""
    if is_mapped and is_radial:
        return _RADIAL_NODES, _RADIAL_LINKS
    return (_MAPPED_NODES, _MAPPED_LINKS) if is_mapped else (_NODES, _LINKS)


def remove(tree):
    """Remove the nodes of `write`: strands have the same color again."""
    for node in _ours(tree).values():
        tree.nodes.remove(node)


def _ours(tree):
    return {node.name.removeprefix(_PREFIX): node for node in tree.nodes if node.name.startswith(_PREFIX)}


def _scale_roughness(tree, hair_node, nodes):
    """Multiply the roughness of a hair node by the factor of each strand."""
    name = f"{_SCALED}{hair_node.name}"
    node = nodes.get(name)
    if node is None:
        node = tree.nodes.new("ShaderNodeMath")
        node.operation, node.name, node.label, node.hide = "MULTIPLY", _PREFIX + name, "Roughness", True
        node.location = (hair_node.location.x - _SPACING[0], hair_node.location.y - 80.0)
        tree.links.new(_output(nodes["Roughness"], "Fac"), node.inputs[0])
    node_values.assign(node.inputs[1], "default_value", _input(hair_node, "Roughness").default_value)
    _link(tree, node.outputs[0], hair_node, "Roughness")


def _vary_radial_roughness(tree, hair_node, nodes, falloff):
    """Give a hair node and the falloff of colors the radial roughness of each strand."""
    _link(tree, _output(nodes["Radial Roughness"], "Fac"), hair_node, "Radial Roughness")
    part = -falloff / float(color_falloff(_input(hair_node, "Radial Roughness").default_value))
    node_values.assign(nodes[_POWERS[0]].inputs[0], "default_value", part * FALLOFF[-1])
    for name, coefficient in zip(_POWERS, reversed(FALLOFF[:-1]), strict=True):
        node_values.assign(nodes[name].inputs[2], "default_value", part * coefficient)


def _build(tree, wanted, links):
    nodes = {}
    for name, (kind, properties, (column, row)) in wanted.items():
        node = nodes[name] = tree.nodes.new(kind)
        node.name = _PREFIX + name
        node.label = name
        for key, value in properties.items():
            setattr(node, key, value)
        if name != "Strands":
            node.parent = nodes["Strands"]
            node.location = (column * _SPACING[0], row * _SPACING[1])
            node.hide = kind != "ShaderNodeAttribute"
    for source, output, target, socket in links:
        tree.links.new(_output(nodes[source], output), _input(nodes[target], socket))
    return nodes


def _values(variation, falloff):
    """Return {node: {input: value}}: `strand_variation.strand_sigma_a` and `pigment.color_from_falloff`."""
    melanin, random_color = variation.melanin, variation.random_color
    return {
        "Factor": {1: 2.0 * random_color, 2: 1.0 - random_color},
        "Light": {1: -melanin, 2: 1.0},
        "Least Light": {1: LEAST_LIGHT},
        # The logarithm to this base is the ratio of two concentrations.
        "Concentration": {1: max(1.0 - melanin, LEAST_LIGHT)},
        "Gradient": {
            "From Min": variation.gradient_start,
            "From Max": max(variation.gradient_end, variation.gradient_start + 1e-4),
        },
        "Tip": {1: variation.tip_absorption - 1.0, 2: 1.0},
        "Pigment": {0: variation.pigment},
        "Dyed": {1: variation.dye},
        "Tip Dye": {0: variation.tip_dye},
        "Square Root": {1: (0.5, 0.5, 0.5)},
        "Falloff": {"Scale": -falloff},
        "Color": {0: (math.e, math.e, math.e)},
    }


def _link(tree, output, node, name):
    """Link a socket, unless an artist has linked something else to it."""
    socket = _input(node, name)
    for link in socket.links:
        if not link.from_node.name.startswith(_PREFIX) or link.from_socket == output:
            return
    tree.links.new(output, socket)


def _input(node, key):
    return _by_identifier(node.inputs, key)


def _output(node, key):
    return _by_identifier(node.outputs, key)


def _by_identifier(sockets, key):
    """Return a socket by its index or its identifier: disabled sockets cannot be looked up by name."""
    return sockets[key] if isinstance(key, int) else next(socket for socket in sockets if socket.identifier == key)
