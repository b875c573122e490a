# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes of hair for EEVEE, which does not support hair BSDFs: light scattered around strands, and a highlight.

EEVEE gives strips of hair the normals of cylinders, so that a glossy surface has the highlight of a fiber. A surface
that is equally diffuse and translucent shows light from all sides alike, like light scattered by hair. Colors are
fitted to renders of the sample head with dark, brown and blond hair in Cycles, with suns in front, at the side and
behind, and with a gray world.
"""

import math

import numpy as np

from ...core.shading import appearance
from ...core.shading.fibre.pigment import color_from_falloff
from ...core.shading.fibre.principled import beta_r_from_roughness
from . import node_values

_PREFIX = "EEVEE "  # of the names of our nodes, which identifies them

# Decrease of ln(color) with sqrt(sigma_a), relative to a groom's in diffuse light: lamps light visible strands.
_FALLOFF = 0.63
_GAIN = 0.62  # of either side
_SURFACE = 0.01  # light reflected around a strand that absorbs all light inside
_GLOSS = 0.05  # reflectance of the highlight, for fibers as reflective as those of Principled Hair

# Name: (type, {property: value}, location relative to the hair node).
_NODES = {
    "Color": ("ShaderNodeVectorMath", {"operation": "MULTIPLY_ADD"}, (200, -160)),
    # EEVEE multiplies light by the color of a translucent surface where it enters and where it leaves.
    "Entering": ("ShaderNodeVectorMath", {"operation": "POWER"}, (380, -160)),
    "Through": ("ShaderNodeBsdfTranslucent", {}, (560, -160)),
    "Back": ("ShaderNodeBsdfDiffuse", {}, (560, -300)),
    # Added, not mixed: EEVEE would also apply a translucent surface's share twice.
    "Around": ("ShaderNodeAddShader", {}, (740, -160)),
    "Highlight": ("ShaderNodeBsdfAnisotropic", {}, (740, -300)),
    "Sum": ("ShaderNodeAddShader", {}, (920, -160)),
    # Otherwise EEVEE assumes that translucent hair is as thick as its bounds, and samples shadows beyond it.
    "Strand": ("ShaderNodeHairInfo", {}, (920, -300)),
    "Output": ("ShaderNodeOutputMaterial", {"target": "EEVEE"}, (1100, -160)),
}

_LINKS = (
    ("Color", 0, "Entering", 0),
    ("Entering", 0, "Through", "Color"),
    ("Color", 0, "Back", "Color"),
    ("Through", 0, "Around", 0),
    ("Back", 0, "Around", 1),
    ("Around", 0, "Sum", 0),
    ("Highlight", 0, "Sum", 1),
    ("Sum", 0, "Output", "Surface"),
    ("Strand", "Thickness", "Output", "Thickness"),
)


def falloff_of(look):
    """Decrease of ln(color) with the square root of the absorption, for varied strands."""
    return _FALLOFF * appearance.kajiya_kay_strand_settings(look).falloff


def write(tree, hair_node, look, varied_color=None):
    """Add or update the nodes for an `Appearance`, unless an artist has added an output for EEVEE.

    varied_color: output of e^(-falloff √sigma_a), None for even hair.
    """
    nodes = _ours(tree)
    if _has_others(tree):
        for node in nodes.values():
            tree.nodes.remove(node)
        return
    if set(nodes) != set(_NODES):
        for node in nodes.values():
            tree.nodes.remove(node)
        nodes = _build(tree, hair_node)
    strands = appearance.kajiya_kay_strand_settings(look)
    gloss = _GLOSS * strands.reflectance / appearance.kajiya_kay_strand_settings(appearance.Appearance()).reflectance
    color = nodes["Color"].inputs
    if varied_color is not None:
        node_values.link(tree, varied_color, color[0])
    else:
        for link in color[0].links:
            tree.links.remove(link)
        even = color_from_falloff(np.array(appearance.sigma_a(look)), falloff_of(look))
        node_values.assign(color[0], "default_value", even)
    node_values.assign(color[1], "default_value", (_GAIN,) * 3)
    node_values.assign(color[2], "default_value", (_SURFACE,) * 3)
    node_values.assign(nodes["Entering"].inputs[1], "default_value", (0.5, 0.5, 0.5))
    node_values.assign(nodes["Highlight"].inputs["Color"], "default_value", (gloss, gloss, gloss, 1.0))
    # A fiber's lobe in half angles is as wide as GGX with slopes of √2 times its deviation; roughness = √slope.
    slope = math.sqrt(2.0) * beta_r_from_roughness((1.0 - strands.coat) * strands.roughness)
    node_values.assign(nodes["Highlight"].inputs["Roughness"], "default_value", min(math.sqrt(slope), 1.0))


def _has_others(tree):
    outputs = [node for node in tree.nodes if node.bl_idname == _NODES["Output"][0] and node.target == "EEVEE"]
    return not all(map(_is_ours, outputs))


def _is_ours(node):
    return node.name.startswith(_PREFIX)


def _ours(tree):
    return {node.name.removeprefix(_PREFIX): node for node in tree.nodes if _is_ours(node)}


def _build(tree, hair_node):
    nodes = {}
    for name, (kind, properties, (x, y)) in _NODES.items():
        node = nodes[name] = tree.nodes.new(kind)
        node.name, node.label = _PREFIX + name, name
        node.location = (hair_node.location.x + x, hair_node.location.y + y)
        for key, value in properties.items():
            setattr(node, key, value)
    for source, output, target, socket in _LINKS:
        tree.links.new(nodes[source].outputs[output], nodes[target].inputs[socket])
    return nodes
