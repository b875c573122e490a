# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of cards and tubes: Principled, for Cycles, EEVEE and what exports it.

Cards are layers of a cloud of strands. Each scatters a part of the light, its albedo a, half back and half through; a
stack of such layers reflects R = (1 - sqrt(1 - a)) / (1 + sqrt(1 - a)) [Kubelka31]. The textures have the color R of a
head of hair, and so a = 4 R / (1 + R)². Engines that let no light through a surface show R itself: exporters find a
plain shader, Cycles and EEVEE one of their own.
"""

import bpy

from ...core.shading import appearance
from ..data.made_meshes import UV_MAP

_ANISOTROPY = 0.8  # highlights run across strands
_SPECULAR = 0.5  # half of a surface's: a texel has strands of many directions


def new_material(name, look, images=None):
    """A material of hair with a look; images: {map: image} of cards, None for a plain color."""
    material = bpy.data.materials.new(name)
    color = (*appearance.mean_color(look), 1.0)
    material.diffuse_color = color
    tree = material.node_tree
    tree.nodes.clear()
    plain = _new_shader(tree, look, color, ("ALL",), 0.0)
    if images is not None:
        nodes = _new_images(tree, images)
        shown = _new_shader(tree, look, color, ("CYCLES", "EEVEE"), -520.0)
        shown.inputs["Thin Wall"].default_value = True
        shown.inputs["Subsurface Weight"].default_value = 1.0
        tree.links.new(nodes["color"].outputs["Color"], plain.inputs["Base Color"])
        tree.links.new(_albedo(tree, nodes["color"].outputs["Color"]), shown.inputs["Base Color"])
        for shader in (plain, shown):
            tree.links.new(nodes["color"].outputs["Alpha"], shader.inputs["Alpha"])
            tree.links.new(nodes["bump"].outputs["Normal"], shader.inputs["Normal"])
            tree.links.new(nodes["tangent"].outputs["Tangent"], shader.inputs["Tangent"])
            shader.inputs["Anisotropic"].default_value = _ANISOTROPY
            shader.inputs["Specular IOR Level"].default_value = 0.5 * _SPECULAR
    return material


def _new_shader(tree, look, color, targets, height):
    shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    shader.location.y = height
    for index, target in enumerate(targets):
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        output.target, output.location = target, (320.0, height - 140.0 * index)
        tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    look = appearance.shaded(look)
    shader.inputs["Base Color"].default_value = color
    shader.inputs["Roughness"].default_value = min(max(look.roughness, 0.05) ** 0.5, 1.0)
    shader.inputs["IOR"].default_value = look.ior
    return shader


def _new_images(tree, images):
    """The nodes of textures, of the normals in them and of the direction across strands."""
    nodes = {}
    for row, kind in enumerate(("color", "normal")):
        node = nodes[kind] = tree.nodes.new("ShaderNodeTexImage")
        node.image, node.location = images[kind], (-900.0, 160.0 - 320.0 * row)
    bump = nodes["bump"] = tree.nodes.new("ShaderNodeNormalMap")
    bump.uv_map, bump.location = UV_MAP, (-560.0, -160.0)
    tree.links.new(nodes["normal"].outputs["Color"], bump.inputs["Color"])
    tangent = nodes["tangent"] = tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.uv_map, tangent.location = "UV_MAP", UV_MAP, (-560.0, -400.0)
    return nodes


def _albedo(tree, color):
    """4 R / (1 + R)² of a color's socket R."""
    above, square, part, albedo = (tree.nodes.new("ShaderNodeVectorMath") for _ in range(4))
    for column, node in enumerate((above, square, part, albedo)):
        node.location = (-740.0 + 160.0 * column, -640.0)
    for node, operation in ((above, "ADD"), (square, "MULTIPLY"), (part, "DIVIDE"), (albedo, "SCALE")):
        node.operation = operation
    above.inputs[1].default_value = (1.0, 1.0, 1.0)
    albedo.inputs["Scale"].default_value = 4.0
    tree.links.new(color, above.inputs[0])
    for side in (0, 1):
        tree.links.new(above.outputs[0], square.inputs[side])
    tree.links.new(color, part.inputs[0])
    tree.links.new(square.outputs[0], part.inputs[1])
    tree.links.new(part.outputs[0], albedo.inputs[0])
    return albedo.outputs[0]
