# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces are in renders and in shadows by their visibility, materials, instances and view layers."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.gpu import lights
from hair_addon.blender.render import drawn_scene, offscreen
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support.pairs import share_of
from tests.support.pictures.rendering import add_orthographic_camera

SIZE = 48
MIDDLE = slice(SIZE // 2 - 2, SIZE // 2 + 2)


def picture(is_transparent=True):
    """Return (H, W, 4) linear pixels of the scene by Vellus, first row at the bottom."""
    bpy.context.view_layer.update()
    settings = PictureSettings(width=SIZE, height=SIZE, samples_per_side=4, is_transparent=is_transparent)
    return offscreen.draw_picture(settings)


def seen_color(drawn):
    """Return the mean color (3,) of a picture's middle."""
    return drawn[MIDDLE, MIDDLE, :3].mean(axis=(0, 1))


def material(shader, **inputs):
    """Return a new material of one shader, with some values."""
    made = bpy.data.materials.new(shader)
    tree = made.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new(shader), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    return made


def matt(*color):
    return material("ShaderNodeBsdfPrincipled", Base_Color=(*color, 1.0), Roughness=1.0, Specular_IOR_Level=0.0)


def plane(made, size=1.0, depth=0.0, name="Plane"):
    """Return a plane that faces the camera, `depth` [m] before the middle of the scene."""
    bpy.ops.mesh.primitive_plane_add(size=size, rotation=(math.pi / 2, 0.0, 0.0), location=(0.0, -depth, 0.0))
    placed = bpy.context.object
    placed.name = name
    placed.data.materials.append(made)
    return placed


def sun(tilt, strength=math.pi):
    """Return a sun that shines along Y, `tilt` [rad] from above."""
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    lamp.data.angle, lamp.data.energy, lamp.rotation_euler = 0.0, strength, (math.pi / 2 - tilt, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(lamp)
    return lamp


def hair_on(surface, **settings):
    bpy.context.view_layer.objects.active = surface
    bpy.ops.vellus.add_hair(**{"guide_count": 20, "strand_count": 60, "length": 0.2, "radius": 0.002} | settings)


@pytest.fixture
def stage(scene):
    """Return a blue wall in the sun, and an orthographic camera that looks along Y at two meters."""
    add_orthographic_camera(scene)
    sun(0.0)
    plane(matt(0.1, 0.2, 0.8), size=4.0, name="Wall")
    return scene


@pytest.mark.parametrize(
    "made",
    [
        lambda: material("ShaderNodeBsdfTransparent"),
        lambda: material("ShaderNodeBsdfPrincipled", Alpha=0.0),
        lambda: material("ShaderNodeBsdfRefraction"),
        lambda: material("ShaderNodeBsdfGlass", IOR=1.0),
    ],
)
def test_what_reflects_nothing_and_is_seen_through_is_not_there(made, stage):
    bare = picture()
    plane(made(), depth=0.5)
    np.testing.assert_array_equal(picture(), bare)


def test_a_viewport_without_materials_shows_what_is_transparent_as_solid(stage):
    """Solid shading draws transparent surfaces as solid, so they hide hair there and not in renders."""
    hair_on(bpy.data.objects["Wall"])
    plane(material("ShaderNodeBsdfTransparent"), depth=0.5)
    bpy.context.view_layer.update()
    space = next(a.spaces.active for s in bpy.data.screens for a in s.areas if a.type == "VIEW_3D")
    given = stage, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get()
    assert [len(drawn_scene.read(*given, viewport).surfaces) for viewport in (space, None)] == [2, 1]


def test_glass_reflects_and_shows_what_is_behind_it(stage):
    """Glass reflects light from one side to the other."""
    bpy.data.objects["Sun"].rotation_euler.x -= math.radians(60.0)
    bare = seen_color(picture())
    plane(material("ShaderNodeBsdfGlass", IOR=1.5, Roughness=0.1), depth=0.5)
    np.testing.assert_allclose(seen_color(picture()), 0.96 * bare, atol=2e-3)


def test_a_diffuse_shader_has_its_color(stage):
    plane(material("ShaderNodeBsdfDiffuse", Color=(0.7, 0.3, 0.1, 1.0)), depth=0.5)
    np.testing.assert_allclose(seen_color(picture()), (0.7, 0.3, 0.1), atol=2e-3)


def test_the_clear_part_of_a_mesh_shows_what_is_behind_it(stage):
    """The clear part of a mesh shows what is behind it: the cornea of an eye does not hide the iris."""
    bpy.data.objects["Sun"].rotation_euler.x -= math.radians(60.0)
    eye = plane(matt(0.8, 0.2, 0.2), depth=0.5)
    plane(material("ShaderNodeBsdfPrincipled", Transmission_Weight=1.0, Roughness=0.1), size=0.6, depth=0.7)
    eye.select_set(True)
    bpy.context.view_layer.objects.active = eye
    bpy.ops.object.join()
    assert len(eye.data.polygons) == 2
    np.testing.assert_allclose(seen_color(picture()), (0.96 * 0.4, 0.96 * 0.1, 0.96 * 0.1), atol=4e-3)


@pytest.mark.parametrize("is_clipped", [False, True])
def test_an_image_ends_where_it_is_clipped(is_clipped, stage):
    made = matt(0.0, 0.0, 0.0)
    tree = made.node_tree
    image, placed, coordinates = map(tree.nodes.new, ("ShaderNodeTexImage", "ShaderNodeMapping", "ShaderNodeTexCoord"))
    image.image = bpy.data.images.new("White", 4, 4)
    image.image.pixels.foreach_set(np.ones(64, np.float32))
    image.extension = "CLIP" if is_clipped else "EXTEND"
    placed.inputs["Location"].default_value = (1.5, 0.0, 0.0)
    tree.links.new(coordinates.outputs["UV"], placed.inputs["Vector"])
    tree.links.new(placed.outputs["Vector"], image.inputs["Vector"])
    tree.links.new(image.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    plane(made, depth=0.5)
    np.testing.assert_allclose(seen_color(picture()), 0.0 if is_clipped else 1.0, atol=5e-3)


@pytest.mark.parametrize(("alpha_mode", "seen"), [("STRAIGHT", 0.4), ("CHANNEL_PACKED", 1.0)])
def test_straight_alpha_lays_an_image_over_black_unless_it_is_read(alpha_mode, seen, stage):
    """A material with straight alpha has the color of Cycles and EEVEE: its image over black, unless alpha is read."""
    made = matt(0.0, 0.0, 0.0)
    tree = made.node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image = bpy.data.images.new("Half", 4, 4, alpha=True)
    image.image.pixels.foreach_set(np.tile(np.float32([1.0, 1.0, 1.0, 0.4]), 16))
    image.image.alpha_mode = alpha_mode
    principled = tree.nodes["Principled BSDF"]
    tree.links.new(image.outputs["Color"], principled.inputs["Base Color"])
    plane(made, depth=0.5)
    np.testing.assert_allclose(seen_color(picture()), seen, atol=0.01)
    tree.links.new(image.outputs["Alpha"], principled.inputs["Alpha"])
    np.testing.assert_allclose(seen_color(picture()), 1.0, atol=0.01)


def test_what_the_camera_does_not_see_still_casts_its_shadow(stage):
    """A surface that the camera does not see, between wall and camera, still casts its shadow."""
    bpy.data.objects["Sun"].rotation_euler.x -= math.radians(30.0)
    blocker = plane(matt(0.8, 0.1, 0.1), size=0.6, depth=0.5)
    hair_on(bpy.data.objects["Wall"], length=0.05, radius=2e-4)  # there are shadows where hair is
    whole = picture()
    blocker.visible_camera = False
    unseen = picture()
    assert seen_color(whole)[0] > 5.0 * seen_color(unseen)[0]
    shaded = unseen[..., 2] < 0.5 * unseen[..., 2].max()
    assert 0.05 < shaded.mean() < 0.15  # 0.6² of 2²
    blocker.visible_shadow = False
    np.testing.assert_allclose(picture()[MIDDLE, MIDDLE, 2], unseen[..., 2].max(), rtol=0.02)
    assert (picture()[..., 2] < 0.5 * unseen[..., 2].max()).mean() < 0.05


def test_what_is_indirect_only_is_not_seen(stage):
    bpy.data.objects["Sun"].rotation_euler.x -= math.radians(60.0)  # its shadow falls beside the surface behind it
    bare = seen_color(picture())
    blocker = plane(matt(0.8, 0.1, 0.1), depth=0.5)
    collection = bpy.data.collections.new("Indirect")
    stage.collection.children.link(collection)
    collection.objects.link(blocker)
    stage.collection.objects.unlink(blocker)
    bpy.context.view_layer.layer_collection.children["Indirect"].indirect_only = True
    np.testing.assert_allclose(seen_color(picture()), bare, rtol=0.02)


@pytest.mark.parametrize("scattering", share_of(["DUAL", "GRID"], 2))
def test_hair_behind_what_the_camera_does_not_see_is_lit(scattering, stage):
    stage.vellus.multiple_scattering = scattering
    skin = plane(matt(0.5, 0.4, 0.3), size=0.8, depth=0.1, name="Skin")
    hair_on(skin, guide_count=60, strand_count=2000)
    bpy.data.objects["Sun"].rotation_euler.x -= math.radians(50.0)
    bare = seen_color(picture())
    gobo = plane(matt(0.0, 0.0, 0.0), size=2.2, depth=3.5)
    assert seen_color(picture()).max() < 0.01
    gobo.visible_camera = False
    np.testing.assert_allclose(seen_color(picture()), bare, rtol=0.1)


def scattered(source):
    """Return an object whose nodes place an instance of another object at that object's position."""
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    info, output = group.nodes.new("GeometryNodeObjectInfo"), group.nodes.new("NodeGroupOutput")
    info.transform_space, info.inputs["Object"].default_value = "RELATIVE", source
    info.inputs["As Instance"].default_value = True
    group.links.new(info.outputs["Geometry"], output.inputs["Geometry"])
    bpy.ops.mesh.primitive_plane_add()
    placed = bpy.context.object
    placed.modifiers.new("Nodes", "NODES").node_group = group
    return placed


@pytest.mark.parametrize("is_hidden", [False, True])
def test_instances_of_objects_that_are_disabled_in_renders_are_seen_as_in_cycles(is_hidden, stage):
    source = plane(matt(0.8, 0.1, 0.1), depth=0.5)
    scattered(source)
    source.hide_render = is_hidden
    np.testing.assert_allclose(seen_color(picture()), (0.8, 0.1, 0.1), atol=2e-3)


def test_instances_of_lights_that_are_disabled_in_renders_shine(stage):
    lamp = bpy.data.objects["Sun"]
    scattered(lamp)
    counts = []
    for is_hidden in (False, True):
        lamp.hide_render = is_hidden
        bpy.context.view_layer.update()
        counts.append(len(lights.read_lights(bpy.context.evaluated_depsgraph_get(), for_render=True)[0]))
    assert counts == [2, 1]


def collection_instance(member):
    """Return an empty that instances a collection of one object, which is in no other collection."""
    collection = bpy.data.collections.new("Instanced")
    collection.objects.link(member)
    bpy.context.scene.collection.objects.unlink(member)
    placed = bpy.data.objects.new("Instance", None)
    placed.instance_type, placed.instance_collection = "COLLECTION", collection
    bpy.context.scene.collection.objects.link(placed)
    return placed


def test_members_of_a_collection_that_are_disabled_in_renders_are_not_seen(stage):
    bare = picture()
    member = plane(matt(0.8, 0.1, 0.1), depth=0.5)
    collection_instance(member)
    np.testing.assert_allclose(seen_color(picture()), (0.8, 0.1, 0.1), atol=2e-3)
    member.hide_render = True
    np.testing.assert_array_equal(picture(), bare)


def test_an_instance_is_a_holdout_as_its_instancer_is(stage):
    placed = collection_instance(plane(matt(0.8, 0.1, 0.1), depth=0.5))
    placed.is_holdout = True
    alpha = picture()[..., 3]
    assert alpha[MIDDLE, MIDDLE].max() == 0.0
    np.testing.assert_allclose(alpha.mean(), 0.75, atol=0.02)


def test_a_view_layer_overrides_material_and_world(stage):
    layer = bpy.context.view_layer
    layer.material_override = matt(0.3, 0.6, 0.3)
    np.testing.assert_allclose(seen_color(picture()), (0.3, 0.6, 0.3), atol=2e-3)
    bpy.data.objects.remove(bpy.data.objects["Wall"])
    world = bpy.data.worlds.new("Override")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.2, 0.0, 0.4, 1.0)
    layer.world_override = world
    np.testing.assert_allclose(seen_color(picture(is_transparent=False)), (0.2, 0.0, 0.4), atol=2e-3)


@pytest.mark.parametrize("kind", ["ORTHO", "PERSP"])
def test_a_mirrored_camera_has_a_mirrored_picture(kind, stage):
    """A mirrored camera gives a mirrored picture of a box and hair in light from the side."""
    stage.camera.data.type = kind
    bpy.data.objects["Sun"].rotation_euler = (math.radians(60.0), 0.0, math.radians(40.0))
    bpy.ops.mesh.primitive_cube_add(size=0.5, location=(-0.5, -0.5, 0.2), rotation=(0.3, 0.2, 0.5))
    bpy.context.object.data.materials.append(matt(0.7, 0.5, 0.2))
    hair_on(plane(matt(0.5, 0.4, 0.3), size=0.5, depth=0.2), guide_count=40, strand_count=1500, length=0.4)
    whole = picture()
    stage.camera.scale.x = -1.0
    mirrored = picture()[:, ::-1]
    blocks = [of.reshape(12, 4, 12, 4, 4).mean(axis=(1, 3)) for of in (whole, mirrored)]
    assert np.abs(whole - whole[:, ::-1]).mean() > 0.03
    np.testing.assert_allclose(*blocks, atol=0.03)


def test_the_shadow_of_a_wide_sun_has_no_line_where_maps_end(stage):
    """The shadow of a wide sun has no line where maps end: a floor far behind a hairy ball is evenly lit."""
    bpy.data.objects.remove(bpy.data.objects["Wall"])
    bpy.ops.mesh.primitive_plane_add(size=12.0)
    bpy.context.object.data.materials.append(matt(0.5, 0.5, 0.5))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(0.0, 0.0, 0.8))
    hair_on(bpy.context.object)
    lamp = bpy.data.objects["Sun"]
    lamp.data.angle, lamp.rotation_euler = 0.6, (math.radians(-45.0), 0.0, math.radians(45.0))
    stage.camera.data.ortho_scale = 6.0
    stage.camera.location, stage.camera.rotation_euler = (0.0, 0.0, 6.0), (0.0, 0.0, 0.0)
    light = picture()[..., 1]
    assert light.min() < 0.1 * np.median(light)  # the shadow, beside which the first rows are
    assert light[:10].min() > 0.97 * np.median(light)
