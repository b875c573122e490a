# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface reflects light to hair above it as an integral gives, and blocks light."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from mathutils import Vector

from hair_addon import api
from hair_addon.blender.data.pictures import surface_means
from hair_addon.blender.host import scene_time
from hair_addon.core.shading import appearance, presets
from hair_addon.core.shading.fibre.angles import fibre_angles
from hair_addon.core.shading.tables import lookup_tables
from tests.support.pictures import glsl

SUN = 3.0  # [W/m²]
BLACK = replace(presets.PRESETS["BLACK"][1], random_color=0.0, roughness=0.3)


def strands_over_a_plane(scene, tangent, color, height=0.06):
    """Add a few black strands of 8 cm, far apart, their middles at a height above a plane; returns their Curves."""
    bpy.ops.mesh.primitive_grid_add(size=4.0)
    plane = bpy.context.object
    plane.is_holdout = True
    material = bpy.data.materials.new("Plane")
    material.node_tree.nodes.clear()
    material.diffuse_color = (*color, 1.0)
    plane.data.materials.append(material)
    middles = np.array([(x, y, height) for x in (-0.6, 0.0, 0.6) for y in (-0.6, 0.0, 0.6)])
    points = middles[:, None] + np.linspace(-0.04, 0.04, 9)[:, None] * np.array(tangent)
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([9] * len(points))
    curves.attributes["position"].data.foreach_set("vector", points.astype(np.float32).ravel())
    curves.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(9 * 9, 0.004, np.float32))
    curves.surface = plane
    scene.collection.objects.link(bpy.data.objects.new("Hair", curves))
    curves.vellus.kind = "HAIR"
    api.shade(curves, BLACK, model="MARSCHNER", mode="energy")
    return curves


def look(scene, towards):
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 2.0
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location = 3.0 * Vector(towards)
    scene.camera.rotation_euler = (-Vector(towards)).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(scene.camera)


def set_light(scene, source):
    """Light the scene by a sun straight above or by a white world."""
    if source == "sun":
        light = bpy.data.lights.new("Sun", "SUN")
        light.energy, light.angle = SUN, 0.0
        scene.collection.objects.link(bpy.data.objects.new("Sun", light))
    else:
        scene.world = bpy.data.worlds.new("World")
        background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
        background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)


def received(source):
    """Return the radiance of a white plane in that light."""
    return SUN / np.pi if source == "sun" else 1.0


def mean_color():
    bpy.context.view_layer.update()
    picture = api.draw(width=96, height=96, samples_per_side=3, is_transparent=True)
    return picture[..., :3].sum(axis=(0, 1)) / picture[..., 3].sum()


def light_from_below(tangent, towards):
    """Return (3,) radiance of a fiber in even light of radiance one from below, by the integral of its BSDF."""
    tables = lookup_tables.bake(appearance.table_settings(BLACK))
    z, turn = (np.arange(60) + 0.5) / 60, 2.0 * np.pi * (np.arange(120) + 0.5) / 120
    z, turn = (grid.ravel() for grid in np.meshgrid(-z, turn))
    across = np.sqrt(1.0 - z * z)
    lights = np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=-1)
    T, V = (np.broadcast_to(np.array(one, float), lights.shape) for one in (tangent, towards))
    return lookup_tables.sample_radiance(tables, fibre_angles(T, lights, V)).mean(axis=0) * 2.0 * np.pi


@pytest.mark.parametrize("tilt", [0.0, 1.2])  # of the strands, above the plane
@pytest.mark.parametrize("source", ["sun", "world"])
def test_a_plane_lights_a_strand_as_much_as_its_directions_say(scene, tilt, source):
    tangent, towards = (np.cos(tilt), 0.0, np.sin(tilt)), (0.0, -0.6, 0.8)
    set_light(scene, source)
    look(scene, towards)
    curves = strands_over_a_plane(scene, tangent, (0.0, 0.0, 0.0))
    without = mean_color()
    curves.surface.data.materials[0].diffuse_color = (0.5, 0.5, 0.5, 1.0)
    found = mean_color() - without
    expected = 0.5 * received(source) * light_from_below(tangent, towards)
    np.testing.assert_allclose(found, expected, rtol=0.2)


def test_a_sun_from_the_side_is_reflected_to_strands_close_to_a_plane(scene):
    """A plane that the sun lights obliquely reflects light to strands close to it, where strands partly block the
    sun.
    """
    tangent, towards, height = (1.0, 0.0, 0.0), (0.0, -0.6, 0.8), 1.0
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = SUN, 0.0
    sun = bpy.data.objects.new("Sun", light)
    sun.rotation_euler = (height, 0.0, 0.0)
    scene.collection.objects.link(sun)
    look(scene, towards)
    curves = strands_over_a_plane(scene, tangent, (0.0, 0.0, 0.0), height=0.012)
    without = mean_color()
    curves.surface.data.materials[0].diffuse_color = (0.5, 0.5, 0.5, 1.0)
    expected = 0.5 * SUN * np.cos(height) / np.pi * light_from_below(tangent, towards)
    np.testing.assert_allclose(mean_color() - without, expected, rtol=0.2)


def test_a_wide_plane_lights_strands_at_any_height(scene):
    """A wide plane gives strands at any height the same light, as uniform light has no distance."""
    tangent, towards = (np.cos(0.5), 0.0, np.sin(0.5)), (0.0, -0.6, 0.8)
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = SUN, 0.0
    scene.collection.objects.link(bpy.data.objects.new("Sun", light))
    look(scene, towards)
    curves = strands_over_a_plane(scene, tangent, (0.0, 0.0, 0.0), height=0.6)
    curves.surface.scale = (20.0, 20.0, 1.0)
    without = mean_color()
    curves.surface.data.materials[0].diffuse_color = (0.5, 0.5, 0.5, 1.0)
    expected = 0.5 * SUN / np.pi * light_from_below(tangent, towards)
    np.testing.assert_allclose(mean_color() - without, expected, rtol=0.2)


@pytest.mark.parametrize("source", ["sun", "world"])
def test_light_off_a_surface_has_the_color_that_is_there(scene, source):
    """Light reflected by a surface has the color of the place below strands, not that of the surface where they
    grow.
    """
    tangent, towards = (1.0, 0.0, 0.0), (0.0, -0.6, 0.8)
    set_light(scene, source)
    look(scene, towards)
    curves = strands_over_a_plane(scene, tangent, (0.0, 0.0, 0.0))
    plane = curves.surface
    bpy.ops.mesh.primitive_grid_add(size=0.1, location=(0.0, 0.0, -50.0))
    curves.surface = bpy.context.object
    curves.surface.data.materials.append(plane.data.materials[0])
    without = mean_color()
    color = (0.6, 0.3, 0.1)
    for value in ((0.0, 1.0, 0.0), color):
        plane.data.materials.append(bpy.data.materials.new("Plane"))
        plane.data.materials[-1].node_tree.nodes.clear()
        plane.data.materials[-1].diffuse_color = (*value, 1.0)
    for polygon in plane.data.polygons:
        polygon.material_index = 2
    expected = np.array(color) * received(source) * light_from_below(tangent, towards)
    np.testing.assert_allclose(mean_color() - without, expected, rtol=0.2)


@pytest.mark.parametrize("source", ["sun", "world"])
def test_an_image_reflects_its_mean_color(scene, source):
    """A plane with a fine checkered image reflects the mean of its colors to strands.

    A view also shows the mean after the image has changed.
    """
    tangent, towards = (1.0, 0.0, 0.0), (0.0, -0.6, 0.8)
    set_light(scene, source)
    look(scene, towards)
    curves = strands_over_a_plane(scene, tangent, (0.0, 0.0, 0.0))
    without = mean_color()
    material = bpy.data.materials.new("Checkered")
    curves.surface.data.materials[0] = material
    tree, image = material.node_tree, bpy.data.images.new("Checkers", 32, 32, float_buffer=True)
    shader = tree.nodes["Principled BSDF"]
    shader.inputs["Specular IOR Level"].default_value, shader.inputs["Roughness"].default_value = 0.0, 1.0
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    checkers = np.indices((32, 32)).sum(axis=0) % 2
    for color in (np.array([0.8, 0.4, 0.2]), np.array([0.2, 0.8, 0.4])):
        pixels = np.ones((32, 32, 4), np.float32)
        pixels[..., :3] = checkers[..., None] * color
        image.pixels.foreach_set(pixels.ravel())
        image.update()
        expected = 0.5 * color * received(source) * light_from_below(tangent, towards)
        np.testing.assert_allclose(mean_color() - without, expected, rtol=0.2)


def test_images_are_not_read_again_while_the_animation_plays(scene, monkeypatch):
    """Pixels of a generated image are read at each reading of the scene, except while the animation plays."""
    image, read = bpy.data.images.new("Skin", 4, 4), []
    reduced = surface_means._reduced
    monkeypatch.setattr(surface_means, "_reduced", lambda raw: (read.append(raw), reduced(raw))[1])
    first = surface_means._picture_of(image)
    assert surface_means._picture_of(image) is first and len(read) == 2
    monkeypatch.setattr(scene_time, "is_shown_moving", lambda: True)
    assert surface_means._picture_of(image) is first and len(read) == 2


def test_no_light_comes_through_a_plane_to_hair_behind_it(scene):
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = SUN, 0.0
    sun = bpy.data.objects.new("Sun", light)
    scene.collection.objects.link(sun)
    look(scene, (0.0, -0.6, -0.8))
    curves = strands_over_a_plane(scene, (0.6, 0.0, -0.8), (0.0, 0.0, 0.0), height=-0.032)
    behind = mean_color()
    curves.surface.hide_render = True
    assert (behind < 0.02 * mean_color()).all()


def test_part_of_the_cone_below_a_plane(rng):
    T, V, N = rng.normal(size=(3, 2000, 3))
    T, V, N = (one / np.linalg.norm(one, axis=1)[:, None] for one in (T, V, N))
    found = glsl.evaluate(glsl.source("fibre/fibre.glsl"), "vec2", "light_from_below(T, V, N)", T=T, V=V, N=N)
    first = np.cross(T, N)
    first /= np.linalg.norm(first, axis=1)[:, None]
    turn = 2.0 * np.pi * (np.arange(720) + 0.5) / 720
    circle = np.cos(turn)[:, None, None] * first + np.sin(turn)[:, None, None] * np.cross(T, first)
    sin_i = -np.sum(T * V, axis=1)[:, None]
    cone = sin_i * T + np.sqrt(1.0 - sin_i**2) * circle
    is_below = np.sum(cone * N, axis=-1) < 0.0
    V_across = V + sin_i * T
    cos_phi = np.sum((cone - sin_i * T) * V_across, axis=-1) / np.sum(V_across**2, axis=1)
    expected = np.stack([is_below.mean(axis=0), 2.0 * (is_below * cos_phi).mean(axis=0)], axis=-1)
    error = np.abs(found - expected)
    assert error.mean() < 0.05  # softened, most where all of it turns around the border
    assert np.quantile(error, 0.99) < 0.35
