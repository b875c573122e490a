# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials with node groups are read as if their nodes were not grouped."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.pictures.surface_materials import read_material
from hair_addon.blender.gpu import lights

COLOR, ROUGHNESS, METALLIC = (0.2, 0.4, 0.6, 1.0), 0.3, 0.7


@pytest.fixture
def image(scene):
    return bpy.data.images.new("Skin", 8, 8)


def new_group(name, inputs=(), outputs=()):
    """Return (tree, its input node, its output node); inputs, outputs: (name, type of socket)."""
    tree = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for sockets, direction in ((inputs, "INPUT"), (outputs, "OUTPUT")):
        for socket, kind in sockets:
            tree.interface.new_socket(socket, in_out=direction, socket_type=kind)
    return tree, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")


def add_group(tree, inside):
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = inside
    return node


def new_material():
    """Return (material, its tree, the input of its output node); the tree has no other node."""
    material = bpy.data.materials.new("Skin")
    material.diffuse_color = (1.0, 0.0, 1.0, 1.0)
    for node in list(material.node_tree.nodes):
        material.node_tree.nodes.remove(node)
    return material, material.node_tree, material.node_tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]


def add_skin(tree, image):
    """Add a Principled BSDF with numbers and with an image that is moved on its UV map."""
    shader, picture, mapping = (
        tree.nodes.new(kind) for kind in ("ShaderNodeBsdfPrincipled", "ShaderNodeTexImage", "ShaderNodeMapping")
    )
    picture.image = image
    mapping.inputs["Location"].default_value = 0.1, 0.2, 0.0
    places = tree.nodes.new("ShaderNodeUVMap")
    places.uv_map = "Face"
    tree.links.new(mapping.inputs["Vector"], places.outputs[0])
    tree.links.new(picture.inputs["Vector"], mapping.outputs[0])
    tree.links.new(shader.inputs["Base Color"], picture.outputs["Color"])
    shader.inputs["Roughness"].default_value, shader.inputs["Metallic"].default_value = ROUGHNESS, METALLIC
    return shader


def in_no_group(image):
    material, tree, shown = new_material()
    tree.links.new(shown, add_skin(tree, image).outputs[0])
    return material


def whole_in_two_groups(image):
    material, tree, shown = new_material()
    inner, _input, inner_end = new_group("Inner", outputs=[("BSDF", "NodeSocketShader")])
    inner.links.new(inner_end.inputs[0], add_skin(inner, image).outputs[0])
    outer, _input, outer_end = new_group("Outer", outputs=[("BSDF", "NodeSocketShader")])
    outer.links.new(outer_end.inputs[0], add_group(outer, inner).outputs[0])
    tree.links.new(shown, add_group(tree, outer).outputs[0])
    return material


def shader_in_a_group(image):
    """Add a shader in a group, its color linked from outside and its numbers set on the group."""
    material, tree, shown = new_material()
    sockets = [("Color", "NodeSocketColor"), ("Rough", "NodeSocketFloat"), ("Metal", "NodeSocketFloat")]
    inside, start, end = new_group("Shader", sockets, [("BSDF", "NodeSocketShader")])
    shader = inside.nodes.new("ShaderNodeBsdfPrincipled")
    for name, output in zip(("Base Color", "Roughness", "Metallic"), start.outputs, strict=False):
        inside.links.new(shader.inputs[name], output)
    inside.links.new(end.inputs[0], shader.outputs[0])
    group = add_group(tree, inside)
    skin = add_skin(tree, image)
    tree.links.new(group.inputs["Color"], skin.inputs["Base Color"].links[0].from_socket)
    tree.nodes.remove(skin)
    group.inputs["Rough"].default_value, group.inputs["Metal"].default_value = ROUGHNESS, METALLIC
    tree.links.new(shown, group.outputs[0])
    return material


def picture_in_a_group(image):
    """Add an image in a group, followed by a muted gamma node and a reroute."""
    material, tree, shown = new_material()
    inside, _start, end = new_group("Picture", outputs=[("Value", "NodeSocketFloat"), ("Color", "NodeSocketColor")])
    skin = add_skin(inside, image)
    inside.links.new(end.inputs["Color"], skin.inputs["Base Color"].links[0].from_socket)
    inside.nodes.remove(skin)
    shader, gamma, way = (
        tree.nodes.new(kind) for kind in ("ShaderNodeBsdfPrincipled", "ShaderNodeGamma", "NodeReroute")
    )
    gamma.mute = True
    tree.links.new(gamma.inputs["Color"], add_group(tree, inside).outputs["Color"])
    tree.links.new(way.inputs[0], gamma.outputs[0])
    tree.links.new(shader.inputs["Base Color"], way.outputs[0])
    shader.inputs["Roughness"].default_value, shader.inputs["Metallic"].default_value = ROUGHNESS, METALLIC
    tree.links.new(shown, shader.outputs[0])
    return material


@pytest.mark.parametrize("build", [whole_in_two_groups, shader_in_a_group, picture_in_a_group])
def test_groups_change_nothing(image, build):
    expected, found = read_material(in_no_group(image)), read_material(build(image))
    assert expected.color_image.image == found.color_image.image == image
    assert found.color_image.uv_map == "Face"
    np.testing.assert_allclose(found.color_image.rows, expected.color_image.rows)
    for name in ("roughness", "metallic", "reflectance", "is_clear"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name)), name
    assert found.roughness == pytest.approx(ROUGHNESS) and found.metallic == pytest.approx(METALLIC)


def test_one_group_with_two_settings_is_two_materials(scene):
    inside, start, end = new_group("Paint", [("Color", "NodeSocketColor")], [("BSDF", "NodeSocketShader")])
    shader = inside.nodes.new("ShaderNodeBsdfPrincipled")
    inside.links.new(shader.inputs["Base Color"], start.outputs[0])
    inside.links.new(end.inputs[0], shader.outputs[0])
    for color in (COLOR, (0.9, 0.1, 0.0, 1.0)):
        material, tree, shown = new_material()
        group = add_group(tree, inside)
        group.inputs[0].default_value = color
        tree.links.new(shown, group.outputs[0])
        np.testing.assert_allclose(read_material(material).color, color[:3], rtol=1e-6)


def test_groups_that_lead_nowhere_leave_the_color_of_the_viewport(scene):
    """Groups without nodes, deleted groups and groups without an output leave the material in its viewport color."""
    empty, _start, _end = new_group("Empty", outputs=[("BSDF", "NodeSocketShader")])
    lost, _start, _end = new_group("Lost", outputs=[("BSDF", "NodeSocketShader")])
    endless, _start, end = new_group("Endless", outputs=[("BSDF", "NodeSocketShader")])
    endless.nodes.remove(end)
    materials = []
    for inside in (empty, lost, endless):
        material, tree, shown = new_material()
        tree.links.new(shown, add_group(tree, inside).outputs[0])
        materials.append(material)
    bpy.data.node_groups.remove(lost)
    for material in materials:
        assert read_material(material).color == (1.0, 0.0, 1.0)


@pytest.mark.parametrize("kind", ["NodeReroute", "ShaderNodeGamma"])
def test_what_nothing_leads_to_sets_nothing(scene, kind):
    """A reroute or a muted node without an input sets no value, so the shader's own color is used, as in Cycles."""
    material, tree, shown = new_material()
    shader, first, second = (tree.nodes.new(one) for one in ("ShaderNodeBsdfPrincipled", kind, kind))
    for node in (first, second):
        node.mute = kind != "NodeReroute"
        node.inputs[0].default_value = (0.7, 0.2, 0.3, 1.0)
    shader.inputs["Base Color"].default_value = COLOR
    tree.links.new(second.inputs[0], first.outputs[0])
    tree.links.new(shader.inputs["Base Color"], second.outputs[0])
    tree.links.new(shown, shader.outputs[0])
    np.testing.assert_allclose(read_material(material).color, COLOR[:3], rtol=1e-6)


def test_nodes_in_a_circle_end(scene):
    """Reading ends for nodes linked in a circle, which Blender keeps, shows in red and ignores."""
    material, tree, shown = new_material()
    shader, gamma, way = (
        tree.nodes.new(kind) for kind in ("ShaderNodeBsdfPrincipled", "ShaderNodeGamma", "NodeReroute")
    )
    gamma.mute = True
    tree.links.new(gamma.inputs["Color"], way.outputs[0])
    tree.links.new(way.inputs[0], gamma.outputs[0])
    tree.links.new(shader.inputs["Base Color"], way.outputs[0])
    tree.links.new(shown, shader.outputs[0])
    bpy.context.view_layer.update()
    assert len(read_material(material).color) == 3


def test_a_world_in_a_group_shines_as_one_without(scene):
    """A world whose color is set on a node group, and whose strength comes from a Value node, is as bright as without
    groups.
    """
    inside, start, end = new_group(
        "Sky", [("Color", "NodeSocketColor"), ("Strength", "NodeSocketFloat")], [("Background", "NodeSocketShader")]
    )
    background = inside.nodes.new("ShaderNodeBackground")
    for name in ("Color", "Strength"):
        inside.links.new(background.inputs[name], start.outputs[name])
    inside.links.new(end.inputs[0], background.outputs[0])
    scene.world = bpy.data.worlds.new("Sky")
    tree = scene.world.node_tree
    for node in list(tree.nodes):
        tree.nodes.remove(node)
    group, strength = add_group(tree, inside), tree.nodes.new("ShaderNodeValue")
    group.inputs["Color"].default_value, strength.outputs[0].default_value = COLOR, 2.5
    tree.links.new(group.inputs["Strength"], strength.outputs[0])
    tree.links.new(tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"], group.outputs[0])
    np.testing.assert_allclose(lights.read_world(scene).color, 2.5 * np.array(COLOR[:3]), rtol=1e-6)
