# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of cards and tubes: Principled, for Cycles, EEVEE and what exports it."""

import bpy

from ...core.shading import appearance
from ..data.made_meshes import UV_MAP

_ANISOTROPY = 0.8  # highlights run across strands


def new_material(name, look, images=None):
    """A material of hair with a look; images: {map: image} of cards, None for a plain color."""
    material = bpy.data.materials.new(name)
    material.diffuse_color = (*appearance.mean_color(look), 1.0)
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location.x = 320.0
    tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    shader.inputs["Base Color"].default_value = (*appearance.mean_color(look), 1.0)
    shader.inputs["Roughness"].default_value = max(appearance.shaded(look).roughness, 0.05) ** 0.5
    shader.inputs["IOR"].default_value = appearance.shaded(look).ior
    if images is not None:
        _add_images(tree, shader, images)
    return material


def _add_images(tree, shader, images):
    nodes = {}
    for row, kind in enumerate(("color", "normal")):
        node = nodes[kind] = tree.nodes.new("ShaderNodeTexImage")
        node.image = images[kind]
        node.location = (-640.0, 160.0 - 320.0 * row)
    tree.links.new(nodes["color"].outputs["Color"], shader.inputs["Base Color"])
    tree.links.new(nodes["color"].outputs["Alpha"], shader.inputs["Alpha"])
    normal = tree.nodes.new("ShaderNodeNormalMap")
    normal.uv_map = UV_MAP
    normal.location = (-300.0, -160.0)
    tree.links.new(nodes["normal"].outputs["Color"], normal.inputs["Color"])
    tree.links.new(normal.outputs["Normal"], shader.inputs["Normal"])
    tangent = tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.uv_map = "UV_MAP", UV_MAP
    tangent.location = (-300.0, -400.0)
    shader.inputs["Anisotropic"].default_value = _ANISOTROPY
    tree.links.new(tangent.outputs["Tangent"], shader.inputs["Tangent"])
