# SPDX-License-Identifier: GPL-3.0-or-later
"""The material that Cycles and EEVEE render hair with, written from the same settings as the live picture."""

import bpy

from ..core.shading import appearance
from . import properties

HAIR_NODE = "ShaderNodeBsdfHairPrincipled"


def write_hair_material(curves):
    """Give Curves a Principled Hair material of their appearance; an artist's own material is left alone."""
    material = next((m for m in curves.materials if m is not None), None)
    if material is None:
        material = bpy.data.materials.new(curves.name)
        curves.materials.append(material)
        node = _hair_node(material.node_tree)
    else:
        node = next((n for n in material.node_tree.nodes if n.bl_idname == HAIR_NODE), None)
    if node is not None:
        _fill(node, material, properties.look_of(curves.vellus))


def _hair_node(tree):
    tree.nodes.clear()
    node = tree.nodes.new(HAIR_NODE)
    node.model = "CHIANG"
    node.parametrization = "ABSORPTION"
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location.x = 300.0
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return node


def _fill(node, material, look):
    color = (*appearance.kajiya_kay_settings(look).diffuse_color, 1.0)
    # By identifier: a socket that the node's parametrization disables cannot be looked up by name.
    sockets = {socket.identifier: socket for socket in node.inputs}
    # EEVEE knows no hair: it shows the colour.
    for name, value in {**appearance.principled_sockets(look), "Color": color}.items():
        sockets[name].default_value = value
    material.diffuse_color = color
