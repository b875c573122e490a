# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of lights and materials without effect are named in the panel and by `vellus render`, all others are read."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.pictures import light_panoramas, shader_sockets, unread_nodes
from hair_addon.blender.gpu import lights
from hair_addon.blender.render.frames.engine import NAME
from tests.support.commands import run_here
from tests.support.interface.layout import draw


@pytest.fixture
def lamp(scene):
    """Return a point light with nodes, and its Emission node."""
    bpy.ops.object.light_add(type="POINT")
    light = bpy.context.object.data
    return light, next(node for node in light.node_tree.nodes if node.type == "EMISSION")


@pytest.fixture
def painted(scene):
    """Return the material of a mesh, and its Principled BSDF."""
    bpy.ops.mesh.primitive_plane_add()
    material = bpy.data.materials.new("Skin")
    bpy.context.object.data.materials.append(material)
    return material, next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")


def link(tree, kind, target):
    node = tree.nodes.new(kind)
    tree.links.new(node.outputs[0], target)
    return node


def told():
    return [text.format(**values) for text, values in unread_nodes.sentences(bpy.context.scene)]


def record():
    (found,), *_others = lights.read_lights(bpy.context.evaluated_depsgraph_get(), True)
    return found


def test_constant_nodes_of_lights_are_read_without_a_sentence(lamp):
    """An RGB node before Emission has the effect of its color, and no sentence."""
    light, emission = lamp
    emission.inputs["Color"].default_value = (0.25, 0.5, 1.0, 1.0)
    plain = record()
    node = link(light.node_tree, "ShaderNodeRGB", emission.inputs["Color"])
    node.outputs[0].default_value = (0.25, 0.5, 1.0, 1.0)
    emission.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    assert told() == []
    for name in plain.dtype.names:
        np.testing.assert_array_equal(record()[name], plain[name], err_msg=name)


def test_nodes_that_compute_constants_light_as_in_cycles(lamp, tmp_path):
    """A plane below a lamp with Blackbody, Math and Light Falloff receives the light of Cycles within 2 %."""
    light, emission = lamp
    tree, scene = light.node_tree, bpy.context.scene
    bpy.context.object.location.z = 2.0
    link(tree, "ShaderNodeBlackbody", emission.inputs["Color"]).inputs["Temperature"].default_value = 2700.0
    falloff = link(tree, "ShaderNodeLightFalloff", emission.inputs["Strength"])
    math = link(tree, "ShaderNodeMath", falloff.inputs["Strength"])
    math.operation, math.inputs[0].default_value, math.inputs[1].default_value = "MULTIPLY", 1.5, 2.5
    assert told() == []
    power = record()["power"][:3]
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    bpy.ops.object.camera_add(location=(0.0, 0.0, 1.0))
    scene.camera, scene.camera.data.type, scene.camera.data.ortho_scale = bpy.context.object, "ORTHO", 0.01
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 16, False
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(tmp_path / "plane.exr")

    def rendered():
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.reshape(image.pixels, (-1, 4))[:, :3].mean(axis=0)
        bpy.data.images.remove(image)
        return pixels

    lit = rendered()
    for socket in emission.inputs:
        for one in socket.links:
            tree.links.remove(one)
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1, 1, 1, 1), 1.0
    np.testing.assert_allclose(power / record()["power"][:3], lit / rendered(), rtol=0.02)


def test_other_nodes_of_lights_are_named(lamp):
    light, emission = lamp
    link(light.node_tree, "ShaderNodeTexNoise", emission.inputs["Color"])
    falloff = link(light.node_tree, "ShaderNodeLightFalloff", emission.inputs["Strength"])
    (sentence,) = told()
    assert sentence.endswith(f'on hair and surfaces: "{light.name}" (Noise Texture).')
    light.node_tree.links.new(falloff.outputs["Linear"], emission.inputs["Strength"])
    sentence, about_distance = told()
    assert sentence.endswith(f'on hair and surfaces: "{light.name}" (Noise Texture, Light Falloff).')
    assert about_distance.endswith(f'at all distances: "{light.name}" (Light Falloff).')
    bpy.context.object.hide_render = True
    assert told() == []


def test_each_math_node_is_computed_once(lamp, monkeypatch):
    """Math nodes that double one another are computed once each."""
    light, emission = lamp
    computed = []
    add = shader_sockets._OPERATIONS["ADD"]
    monkeypatch.setitem(shader_sockets._OPERATIONS, "ADD", lambda a, b: computed.append(a) or add(a, b))
    node = link(light.node_tree, "ShaderNodeMath", emission.inputs["Strength"])
    for _doubling in range(7):
        before = link(light.node_tree, "ShaderNodeMath", node.inputs[0])
        light.node_tree.links.new(before.outputs[0], node.inputs[1])
        node = before
    node.inputs[0].default_value = node.inputs[1].default_value = 0.5
    assert shader_sockets.ShaderInput(emission.inputs["Strength"]).constant() == 128.0
    assert len(computed) == 8


def test_very_long_chains_and_very_large_numbers_are_not_read(lamp, monkeypatch):
    """Hundreds of Math nodes after one another, and a number that GPUs cannot store, are named."""
    light, emission = lamp
    monkeypatch.setattr(light_panoramas, "find", lambda *_light: None)
    first = node = link(light.node_tree, "ShaderNodeMath", emission.inputs["Strength"])
    for _sum in range(600):
        node = link(light.node_tree, "ShaderNodeMath", node.inputs[0])
    (sentence,) = told()
    assert sentence.endswith(f'on hair and surfaces: "{light.name}" (Math).')
    light.node_tree.links.remove(first.inputs[0].links[0])
    assert told() == []
    first.operation, first.inputs[0].default_value, first.inputs[1].default_value = "MULTIPLY", 1e30, 1e30
    (sentence,) = told()
    assert sentence.endswith(f'on hair and surfaces: "{light.name}" (Math).')
    assert np.isfinite(record()["power"]).all()


def test_procedural_materials_are_named_and_images_are_not(painted):
    material, shader = painted
    assert told() == []
    link(material.node_tree, "ShaderNodeTexImage", shader.inputs["Base Color"])
    assert told() == []
    link(material.node_tree, "ShaderNodeTexNoise", shader.inputs["Base Color"])
    (sentence,) = told()
    assert '"Skin" (Noise Texture)' in sentence
    output = material.node_tree.get_output_node("ALL")
    link(material.node_tree, "ShaderNodeBsdfToon", output.inputs["Surface"])
    assert '"Skin" (Toon BSDF)' in told()[0]


def test_panel_and_command_line_name_them(painted, tmp_path):
    material, shader = painted
    link(material.node_tree, "ShaderNodeTexNoise", shader.inputs["Base Color"])
    bpy.ops.object.camera_add()
    bpy.context.scene.camera = bpy.context.object
    bpy.context.scene.render.engine = NAME
    assert any("(Noise Texture)" in text for text in draw(bpy.types.VELLUS_PT_sampling).texts)
    path = tmp_path / "a.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    ended = run_here("render", path, "--out", tmp_path / "a.png", "--dry-run")
    assert ended.status == 0 and '"Skin" (Noise Texture)' in ended.errors


def test_a_panel_reads_nodes_again_only_after_a_change(painted, monkeypatch):
    """A redraw without a change reads no nodes; a changed node, object or file is shown by the next redraw."""
    material, shader = painted
    read, real = [], unread_nodes.sentences
    monkeypatch.setattr(unread_nodes, "sentences", lambda scene: read.append(scene) or real(scene))
    bpy.context.scene.render.engine = NAME

    def shown():
        bpy.context.view_layer.update()
        return [text for text in draw(bpy.types.VELLUS_PT_sampling).texts if "(Noise Texture)" in text]

    assert shown() == shown() == [] and len(read) == 1
    link(material.node_tree, "ShaderNodeTexNoise", shader.inputs["Base Color"])
    assert len(shown()) == len(shown()) == 1 and len(read) == 2
    bpy.context.object.hide_render = True
    assert shown() == shown() == [] and len(read) == 3
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.context.scene.render.engine = NAME
    assert shown() == [] and len(read) == 4


def test_sentences_load_no_images(painted, tmp_path):
    """Sentences about materials, which a panel shows, do not load files of images."""
    material, shader = painted
    path = str(tmp_path / "skin.png")
    made = bpy.data.images.new("Skin", 4, 4)
    made.filepath_raw, made.file_format = path, "PNG"
    made.save()
    image = bpy.data.images.load(path, check_existing=False)
    link(material.node_tree, "ShaderNodeTexImage", shader.inputs["Base Color"]).image = image
    normal = link(material.node_tree, "ShaderNodeNormalMap", shader.inputs["Normal"])
    link(material.node_tree, "ShaderNodeTexImage", normal.inputs["Color"]).image = image
    assert told() == [] and not image.has_data
