# SPDX-License-Identifier: GPL-3.0-or-later
"""Cards let light through forward, and exporters find a plain shader."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.materials import card_material
from hair_addon.core.shading.appearance import Appearance


@pytest.fixture
def card(scene):
    """Return a plane that faces the camera, with one color and strands that cover it."""
    images = {}
    for kind, pixel in (("color", (0.3, 0.2, 0.1, 1.0)), ("normal", (0.5, 0.5, 1.0, 1.0))):
        images[kind] = bpy.data.images.new(kind, 4, 4, float_buffer=True)
        images[kind].colorspace_settings.name = "Non-Color"
        images[kind].pixels.foreach_set(np.tile(np.array(pixel, np.float32), 16))
    bpy.ops.mesh.primitive_plane_add(size=10.0)
    bpy.context.object.data.materials.append(card_material.new_material("Card", Appearance(), images))
    return bpy.context.object


def light_through(angle, tmp_path):
    """Return the radiance (3,) of the card from below, by a sun at an angle [degrees] from the line of sight above
    it.
    """
    blender_scene = bpy.context.scene
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler.x = math.radians(angle)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, 0.0, -5.0), (math.pi, 0.0, 0.0)
    for one in (sun, camera):
        blender_scene.collection.objects.link(one)
    blender_scene.camera, render = camera, blender_scene.render
    render.engine, blender_scene.cycles.samples, blender_scene.cycles.use_denoising = "CYCLES", 32, False
    render.resolution_x = render.resolution_y = 6
    render.image_settings.file_format, render.filepath = "OPEN_EXR", str(tmp_path / f"{angle}.exr")
    bpy.ops.render.render(write_still=True)
    image, pixels = bpy.data.images.load(render.filepath), np.empty((36, 4), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    for one in (sun, camera):
        bpy.data.objects.remove(one)
    return pixels[:, :3].mean(axis=0)


def test_cards_shine_before_a_sun(card, tmp_path):
    before, beside = (light_through(angle, tmp_path) for angle in (15.0, 75.0))
    # Light on the card falls with the cosine; layers that scatter evenly would have no more than that.
    assert (before > 2.0 * beside * math.cos(math.radians(15.0)) / math.cos(math.radians(75.0))).all()


def test_exporters_find_one_shader_with_the_texture(card):
    nodes = card.data.materials[0].node_tree.nodes
    outputs = {node.target: node for node in nodes if node.bl_idname == "ShaderNodeOutputMaterial"}
    assert set(outputs) == {"ALL", "CYCLES", "EEVEE"}
    plain = outputs["ALL"].inputs["Surface"].links[0].from_node
    assert plain.inputs["Base Color"].links[0].from_node.image.name.startswith("color")
    assert plain.inputs["Transmission Weight"].default_value == 0.0


def test_light_from_behind_reaches_the_eye_in_eevee(card):
    """Cards in EEVEE transmit light from behind, although EEVEE lights only their first layer."""
    nodes = card.data.materials[0].node_tree.nodes
    output = next(n for n in nodes if n.bl_idname == "ShaderNodeOutputMaterial" and n.target == "EEVEE")
    total = output.inputs["Surface"].links[0].from_node
    kinds = {one.links[0].from_node.bl_idname for one in total.inputs}
    assert kinds == {"ShaderNodeBsdfPrincipled", "ShaderNodeBsdfTranslucent"}
