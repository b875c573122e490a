# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of worlds with nodes compared with Cycles: Sky Texture, a color ramp with a mapping, noise, an image."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.gpu import lights, world_texture
from hair_addon.core.imaging import environment

pytestmark = pytest.mark.usefixtures("fine_world")

_SIDES = np.vstack([np.eye(3), -np.eye(3)])


def sky(tree):
    node = tree.nodes.new("ShaderNodeTexSky")
    node.sun_elevation, node.sun_rotation = 0.6, 1.2
    return node.outputs["Color"]


def sky_without_sun(tree):
    node = tree.nodes.new("ShaderNodeTexSky")
    node.sun_disc, node.sun_elevation = False, 0.3
    return node.outputs["Color"]


def mapped(tree, node, rotation, scale=(1.0, 1.0, 1.0)):
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.inputs["Rotation"].default_value, mapping.inputs["Scale"].default_value = rotation, scale
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    return node


def ramp(tree):
    gradient = mapped(tree, tree.nodes.new("ShaderNodeTexGradient"), (0.4, 0.2, 1.0))
    colors = tree.nodes.new("ShaderNodeValToRGB")
    colors.color_ramp.elements[0].color, colors.color_ramp.elements[1].color = (0.05, 0.1, 0.6, 1), (1, 0.6, 0.2, 1)
    tree.links.new(gradient.outputs[1], colors.inputs[0])
    return colors.outputs["Color"]


def noise(tree):
    node = mapped(tree, tree.nodes.new("ShaderNodeTexNoise"), (0.0, 0.0, 0.3))
    node.inputs["Scale"].default_value = 6.0
    return node.outputs["Color"]


def image(tree):
    picture = bpy.data.images.new("Surroundings", 256, 128, float_buffer=True, is_data=True)
    v, u = np.mgrid[:128, :256] / np.array([128.0, 256.0])[:, None, None]
    bright = 20.0 * np.exp(-300.0 * ((u - 0.3) ** 2 + (v - 0.7) ** 2))
    pixels = np.stack([u + bright, v + bright, 0.3 + bright, np.ones_like(u)], axis=-1).astype(np.float32)
    picture.pixels.foreach_set(pixels.ravel())
    picture.pack()
    node = mapped(tree, tree.nodes.new("ShaderNodeTexEnvironment"), (0.3, 0.5, 1.1), (1.0, 1.0, 0.8))
    node.image = picture
    return node.outputs["Color"]


def plane_irradiance(scene, direction):
    """Return (3,) irradiance of a plane that faces a direction, rendered by Cycles from a white diffuse cube."""
    camera = scene.camera
    camera.location = [3.0 * part for part in direction]
    camera.rotation_euler = camera.location.to_track_quat("Z", "Y").to_euler()
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(len(picture.pixels), np.float32)
    picture.pixels.foreach_get(pixels)
    bpy.data.images.remove(picture)
    return np.pi * pixels.reshape(-1, 4)[:, :3].mean(axis=0)


def white_cube(scene, folder):
    """Set up renders of a cube by an orthographic camera that sees one side."""
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    material = bpy.data.materials.new("White")
    output = material.node_tree.get_output_node("ALL")
    shader = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 0.5
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.collection.objects.link(scene.camera)
    scene.render.engine, scene.cycles.samples, scene.cycles.max_bounces = "CYCLES", 2048, 0
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.sample_clamp_direct = 0.0
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(folder / "side.exr")


@pytest.mark.long
@pytest.mark.parametrize("nodes", [sky, sky_without_sun, ramp, noise, image])
def test_worlds_of_nodes_light_planes_as_in_cycles(tmp_path, nodes):
    """Planes in six directions receive the light of Cycles within 2 % of the brightest of them."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    tree = scene.world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(nodes(tree), background.inputs["Color"])
    radiance = world_texture.picture_of(lights.read_world(scene))
    directions, solid_angles = environment._texels(*radiance.shape[:2])
    cosines = np.maximum(_SIDES @ directions.T, 0.0) * solid_angles
    found = cosines @ radiance.reshape(-1, 3)
    white_cube(scene, tmp_path)
    wanted = np.stack([plane_irradiance(scene, side) for side in _SIDES])
    error = np.abs(found - wanted).max() / wanted.max()
    print(f"{nodes.__name__}: error {100.0 * error:.2f} %")
    assert error < 0.02
