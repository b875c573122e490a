# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair spreads the light that it transmits to a surface below, and large lights fade gradually at the horizon."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import scene as scene_data
from hair_addon.blender.gpu import drawing
from hair_addon.blender.gpu.visibility_buffer import VisibilityBuffer
from hair_addon.blender.render import drawn_scene, scene_drawing

PERIOD = 0.04  # [m] of a sheet of hair that is thin and thick in turns
STRAND_COUNT = 10_000
SIZE = 96, 24  # pixels: six periods


def plane_and_sun(scene, elevation=0.5 * np.pi, angle=0.0):
    """Return a white matte plane below a camera, in a sun at an elevation [rad]."""
    bpy.ops.mesh.primitive_grid_add(size=4.0)
    plane = bpy.context.object
    material = bpy.data.materials.new("Plane")
    principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Base Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    principled.inputs["Specular IOR Level"].default_value = 0.0
    plane.data.materials.append(material)
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = np.pi, angle
    sun = bpy.data.objects.new("Sun", light)
    sun.rotation_euler.y = 0.5 * np.pi - elevation
    scene.collection.objects.link(sun)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 6.0 * PERIOD
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location.z = 3.0
    scene.collection.objects.link(scene.camera)
    return plane


def add_sheet(scene, plane, rng, strand_count=STRAND_COUNT):
    """Add blond strands along Y, in each period along X half of them three deep and half twelve; returns their
    object.
    """
    x = rng.uniform(-6.0, 6.0, strand_count) * PERIOD
    x = x[(x % PERIOD < 0.5 * PERIOD) | (rng.random(len(x)) < 0.25)]
    points = np.stack(np.broadcast_arrays(x[:, None], np.linspace(-0.4, 0.4, 3), 0.0), axis=-1)
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([3] * len(points))
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    radius = 12.0 * PERIOD * 12.0 / strand_count / 2.0
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set(
        "value", np.full(points.shape[:2], radius, np.float32).ravel()
    )
    curves.surface = plane
    sheet = bpy.data.objects.new("Hair", curves)
    scene.collection.objects.link(sheet)
    curves.vellus.kind, curves.vellus.marschner.size = "HAIR", 16
    api.shade(curves, "BLOND", model="MARSCHNER", mode="energy", random_color=0.0)
    return sheet


def light_along_x(pass_count=4):
    """Return (W, 3) light of the plane without hair in the picture: the mean of some passes and of all rows."""
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
    camera = scene_data.read_camera(bpy.context.scene, depsgraph, *SIZE)
    buffer, light = VisibilityBuffer(*SIZE), 0.0
    for turn in range(pass_count):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(scene_drawing, "_hair_in_view", lambda *_given, **_options: [])
            scene_drawing.draw(drawn, drawing.pass_record(*camera, SIZE, turn), buffer, is_transparent=True)
        light = light + np.array(buffer.color.read(), np.float32).reshape(*SIZE[::-1], 4)[..., :3].mean(axis=0)
    return light / pass_count


def test_light_that_strands_pass_on_is_spread_by_their_height(scene, rng):
    """The shadow of a sheet two periods above has no stripes, and transmits as much light as from close by."""
    sheet = add_sheet(scene, plane_and_sun(scene), rng)
    found = []
    for height in (0.05 * PERIOD, 2.0 * PERIOD):
        sheet.location.z = height
        found.append(light_along_x()[:, 0])
    near, far = found
    assert near.std() > 0.2 * near.mean()
    assert far.std() < 0.35 * near.std()
    np.testing.assert_allclose(far.mean(), near.mean(), rtol=0.1)


@pytest.mark.parametrize("elevation", [-0.15, 0.0, 0.2, 0.6])
def test_a_wide_light_sets_slowly(elevation, scene):
    """A plane receives the mean cosine of the directions to the part of a wide light that is above it."""
    half_angle = 0.35
    plane_and_sun(scene, elevation, 2.0 * half_angle)
    angle, turn = (grid.ravel() for grid in np.meshgrid((np.arange(200) + 0.5) / 200, np.arange(400) * np.pi / 200))
    tangent = np.tan(half_angle) * np.sqrt(angle)  # even over the disk
    height = np.sin(elevation) + np.cos(elevation) * tangent * np.sin(turn)
    cosine = 1.0 / np.sqrt(1.0 + tangent**2)  # to the middle: a sun's strength is that on a plane across it
    expected = np.maximum(height * cosine, 0.0).mean() / cosine.mean()
    np.testing.assert_allclose(light_along_x(1).mean(), expected, atol=0.015)


def test_a_plane_that_light_grazes_does_not_shade_itself(scene, rng):
    """A plane in grazing light stays as bright beside strands too thin for shadows, although the sun then has a
    shadow map.
    """
    plane = plane_and_sun(scene, 0.25, 0.4)
    alone = light_along_x(1)
    radii = add_sheet(scene, plane, rng, strand_count=1000).data.attributes["radius"].data
    radii.foreach_set("value", np.full(len(radii), 1e-9, np.float32))
    np.testing.assert_allclose(light_along_x(1), alone, rtol=0.02)
