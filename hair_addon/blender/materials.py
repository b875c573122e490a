# SPDX-License-Identifier: GPL-3.0-or-later
"""The material that Cycles and EEVEE render hair with, written from the same settings as the live picture."""

import bpy

from ..core.shading import lookup_tables, pigment, principled
from . import properties

HAIR_NODE = "ShaderNodeBsdfHairPrincipled"


def write_hair_material(curves):
    """Give Curves a Principled Hair material of their Marschner settings; an artist's own material is left alone."""
    material = next((m for m in curves.materials if m is not None), None)
    if material is None:
        material = bpy.data.materials.new(curves.name)
        curves.materials.append(material)
        node = _hair_node(material.node_tree)
    else:
        node = next((n for n in material.node_tree.nodes if n.bl_idname == HAIR_NODE), None)
    if node is not None:
        _fill(node, material, properties.to_settings(curves.vellus.marschner, lookup_tables.Settings))


def _hair_node(tree):
    tree.nodes.clear()
    node = tree.nodes.new(HAIR_NODE)
    node.model = "CHIANG"
    node.parametrization = "ABSORPTION"
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location.x = 300.0
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return node


def _fill(node, material, settings):
    color = (*pigment.color_from_sigma_a(settings.sigma_a), 1.0)
    node.inputs["Absorption Coefficient"].default_value = settings.sigma_a
    node.inputs["IOR"].default_value = settings.eta
    node.inputs["Offset"].default_value = settings.tilt
    if settings.mode == "energy":
        node.inputs["Roughness"].default_value = settings.roughness
        node.inputs["Radial Roughness"].default_value = settings.radial_roughness
        node.inputs["Coat"].default_value = settings.coat
    else:
        node.inputs["Roughness"].default_value = principled.roughness_from_beta_r(settings.beta_r)
    # What EEVEE shows, which knows no hair. By identifier: the socket is disabled, and cannot be looked up by name.
    next(s for s in node.inputs if s.identifier == "Color").default_value = color
    material.diffuse_color = color
