# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of cards and tubes: Principled BSDFs for Cycles, EEVEE and exporters.

Cards are layers of a cloud of strands. Each layer scatters a fraction of the light, its albedo a. A fraction t of that
continues forward, like most light that crosses a fiber; the rest goes half back and half through. By the relation of
Kubelka and Munk, (1 - R)² / (2 R) = K / S with K = 1 - a and S = (1 - t) a / 2, a stack of layers reflects R if
[Kubelka31]

    a = R / (R + (1 - t) (1 - R)² / 4)

The textures have the color R of a head of hair. Engines without transmission show R itself: exporters find a plain
shader, Cycles and EEVEE have their own shaders. EEVEE takes transmission from the picture behind a surface instead of
the layers behind it, so t = 0. Light only reaches the first layer there: each layer scatters more than all of its
light, to represent the layers behind it.
"""

import bpy

from ...core.cards import texture_layouts
from ...core.shading import appearance
from ..data.made.made_meshes import COLOR, UV_MAP

_ANISOTROPY = 0.8  # highlights run across strands
# Fraction of the scattered light that continues forward. With backlight from a sun, cards in Cycles had 0.1 to 0.17 of
# the red light of blond, auburn and brown strands with 0, and 0.5 to 0.8 with 0.75 to 0.85; with light from the side or
# the front 0.9 to 1.4.
_FORWARD = 0.8
_SPECULAR = 0.5  # half of a surface's: a texel contains strands of many directions
# In EEVEE: factors of a layer's albedo, of additional light from behind, and of a surface's highlights, which are not
# stretched across strands. Relative to red, green and blue of auburn strands in Cycles, cards have with light from the
# front, the side and behind (0.93 0.66 0.61), (1.16 0.91 0.93), (0.50 0.32 0.41); with 1, 0 and 0.5 half as much.
_LAYERED, _BEHIND, _UNSTRETCHED = 1.7, 0.4, 1.2


def new_material(name, look, images=None, has_colors=False):
    """Return a new material of hair with a look; images: {map: image} of cards, None for a plain color.

    has_colors: whether the color attribute of the mesh replaces the plain color.
    """
    material = bpy.data.materials.new(name)
    color = (*appearance.mean_color(look), 1.0)
    material.diffuse_color = color
    tree = material.node_tree
    tree.nodes.clear()
    plain = _new_shader(tree, look, color, "ALL", 0.0)
    if has_colors:
        colors = tree.nodes.new("ShaderNodeVertexColor")
        colors.layer_name, colors.location = COLOR, (-260.0, 0.0)
        tree.links.new(colors.outputs["Color"], plain.inputs["Base Color"])
    if images is not None:
        nodes = _new_images(tree, images)
        shaders = [plain]
        tree.links.new(nodes["color"].outputs["Color"], plain.inputs["Base Color"])
        for row, (target, forward) in enumerate((("CYCLES", _FORWARD), ("EEVEE", 0.0)), 1):
            shown = _new_shader(tree, look, color, target, -720.0 * row)
            shown.inputs["Thin Wall"].default_value = True
            shown.inputs["Subsurface Weight"].default_value = 1.0
            shown.inputs["Transmission Weight"].default_value = forward
            albedo = _albedo(tree, nodes["color"].outputs["Color"], forward, -720.0 * row - 120.0)
            tree.links.new(albedo, shown.inputs["Base Color"])
            shaders.append(shown)
            if target == "EEVEE":
                _let_through(tree, shown, albedo, nodes)
        for shader in shaders:
            tree.links.new(nodes["color"].outputs["Alpha"], shader.inputs["Alpha"])
            tree.links.new(nodes["bump"].outputs["Normal"], shader.inputs["Normal"])
            tree.links.new(nodes["tangent"].outputs["Tangent"], shader.inputs["Tangent"])
            if "roughness" in nodes:
                tree.links.new(nodes["roughness"].outputs["Green"], shader.inputs["Roughness"])
            shader.inputs["Anisotropic"].default_value = _ANISOTROPY
            shader.inputs["Specular IOR Level"].default_value = 0.5 * _SPECULAR
        shaders[-1].inputs["Specular IOR Level"].default_value = 0.5 * _UNSTRETCHED
    return material


def _new_shader(tree, look, color, target, height):
    shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    shader.location.y = height
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.target, output.location = target, (320.0, height)
    tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    look = appearance.shaded(look)
    shader.inputs["Base Color"].default_value = color
    shader.inputs["Roughness"].default_value = float(texture_layouts.surface_roughness(look.roughness))
    shader.inputs["IOR"].default_value = look.ior
    return shader


def _new_images(tree, images):
    """Create nodes of textures, of the normals in them and of the tangent across strands.

    Textures that no shader uses have nodes too, so that Blender saves and appends them with the material.
    """
    nodes = {}
    for row, kind in enumerate(kind for kind in images if kind not in ("color", "normal")):
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image, node.label, node.location = images[kind], kind, (-1260.0, 160.0 - 320.0 * row)
        if kind == "roughness":  # where exporters look for it, in the green channel
            channels = nodes[kind] = tree.nodes.new("ShaderNodeSeparateColor")
            channels.location = (-900.0, -480.0)
            tree.links.new(node.outputs["Color"], channels.inputs["Color"])
    for row, kind in enumerate(("color", "normal")):
        node = nodes[kind] = tree.nodes.new("ShaderNodeTexImage")
        node.image, node.location = images[kind], (-900.0, 160.0 - 320.0 * row)
    bump = nodes["bump"] = tree.nodes.new("ShaderNodeNormalMap")
    bump.uv_map, bump.location = UV_MAP, (-560.0, -160.0)
    tree.links.new(nodes["normal"].outputs["Color"], bump.inputs["Color"])
    tangent = nodes["tangent"] = tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.uv_map, tangent.location = "UV_MAP", UV_MAP, (-560.0, -400.0)
    return nodes


def _let_through(tree, shader, albedo, nodes):
    """Let a shader for EEVEE represent the layers behind it, and transmit light from behind."""
    place = shader.location
    layered, behind, covered = (tree.nodes.new("ShaderNodeVectorMath") for _ in range(3))
    through, total = tree.nodes.new("ShaderNodeBsdfTranslucent"), tree.nodes.new("ShaderNodeAddShader")
    for row, node in enumerate((layered, behind, covered)):
        node.operation, node.location = "SCALE", (-260.0, place.y - 160.0 * row)
    through.location, total.location = (0.0, place.y - 520.0), (240.0, place.y - 520.0)
    for node, factor in ((layered, _LAYERED), (behind, _BEHIND)):
        node.inputs["Scale"].default_value = factor
        tree.links.new(albedo, node.inputs[0])
    tree.links.new(layered.outputs[0], shader.inputs["Base Color"])
    tree.links.new(behind.outputs[0], covered.inputs[0])
    tree.links.new(nodes["color"].outputs["Alpha"], covered.inputs["Scale"])
    tree.links.new(covered.outputs[0], through.inputs["Color"])
    tree.links.new(nodes["bump"].outputs["Normal"], through.inputs["Normal"])
    (shown,) = shader.outputs["BSDF"].links
    output = shown.to_socket
    tree.links.new(shader.outputs["BSDF"], total.inputs[0])
    tree.links.new(through.outputs["BSDF"], total.inputs[1])
    tree.links.new(total.outputs["Shader"], output)


def _albedo(tree, color, forward, height):
    """Return the socket of R / (R + (1 - t) (1 - R)² / 4) for a color's socket R."""
    missing, square, total, albedo = (tree.nodes.new("ShaderNodeVectorMath") for _ in range(4))
    for column, node in enumerate((missing, square, total, albedo)):
        node.location = (-740.0 + 160.0 * column, height)
    for node, operation in ((missing, "SUBTRACT"), (square, "MULTIPLY"), (total, "MULTIPLY_ADD"), (albedo, "DIVIDE")):
        node.operation = operation
    missing.inputs[0].default_value = (1.0, 1.0, 1.0)
    total.inputs[1].default_value = (0.25 * (1.0 - forward),) * 3
    tree.links.new(color, missing.inputs[1])
    for side in (0, 1):
        tree.links.new(missing.outputs[0], square.inputs[side])
    tree.links.new(square.outputs[0], total.inputs[0])
    tree.links.new(color, total.inputs[2])
    tree.links.new(color, albedo.inputs[0])
    tree.links.new(total.outputs[0], albedo.inputs[1])
    return albedo.outputs[0]
