# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces match Cycles: rough and glossy, dielectric and metal, with image textures, region by region."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.pictures import drawn_meshes, surface_materials
from hair_addon.blender.data.scene import read_camera
from hair_addon.blender.gpu import drawing, visibility_buffer
from hair_addon.blender.host import notices
from hair_addon.blender.render import drawn_scene, offscreen, scene_drawing
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support.pairs import pairs
from tests.support.pictures.rendering import add_orthographic_camera

SIZE = 48


def picture():
    """Return (H, W, 4) linear pixels of the scene by Vellus, first row at the bottom."""
    return offscreen.draw_picture(PictureSettings(width=SIZE, height=SIZE, samples_per_side=4, is_transparent=True))


def by_cycles(tmp_path):
    """Return Cycles' picture of light that arrives directly from lamps and the world."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.film_transparent = True
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles = scene.cycles
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling, cycles.max_bounces = 64, False, False, 0
    cycles.pixel_filter_type, cycles.blur_glossy = "BOX", 0.0
    scene.render.filepath = str(tmp_path / "cycles.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath, check_existing=False)
    pixels = np.array(image.pixels[:], np.float32).reshape(SIZE, SIZE, 4)
    bpy.data.images.remove(image)
    return pixels


def material_of(surface, **inputs):
    """Return the Principled BSDF node, with values, of a new material of a mesh object."""
    material = bpy.data.materials.new("Surface")
    surface.data.materials.append(material)
    principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for name, value in inputs.items():
        principled.inputs[name.replace("_", " ")].default_value = value
    return principled


@pytest.fixture
def stage(scene):
    """Return an empty, unlit scene with an orthographic camera that looks along Y at two meters."""
    add_orthographic_camera(scene)
    return scene


def test_a_surface_without_a_material_is_as_with_a_new_one(stage):
    """A surface without a material looks like one with a new material, as in EEVEE and Cycles."""
    sun(math.radians(70.0), 0.0, 0.0)
    placed = ball()
    with_one = picture()
    placed.data.materials.clear()
    np.testing.assert_array_equal(picture(), with_one)


def test_triangles_know_their_materials(stage):
    """Paths of light read color, roughness, metallic and reflectance of each triangle."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=1)
    placed = bpy.context.object
    material_of(placed, Base_Color=(0.2, 0.4, 0.6, 1.0), Roughness=0.3, IOR=1.5)
    material_of(placed, Base_Color=(0.9, 0.8, 0.7, 1.0), Roughness=0.6, Metallic=1.0, Specular_IOR_Level=0.0)
    placed.data.polygons[1].material_index = 1
    (mesh,) = drawn_meshes.read_drawn_meshes(bpy.context.evaluated_depsgraph_get())
    expected = [[0.2, 0.4, 0.6, 0.3, 0.0, 0.04]] * 2 + [[0.9, 0.8, 0.7, 0.6, 1.0, 0.0]] * 2
    np.testing.assert_allclose(mesh.triangle_materials, expected, rtol=1e-6)


def sun(*angles, strength=3.0):
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    lamp.data.angle, lamp.data.energy, lamp.rotation_euler = 0.0, strength, angles
    bpy.context.scene.collection.objects.link(lamp)


def ball(**inputs):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6, radius=0.9)
    bpy.context.object.data.shade_smooth()
    material_of(bpy.context.object, **inputs)
    return bpy.context.object


def image_of(pixels, name="Image", is_data=False):
    """Return an image of (H, W, 3) stored values."""
    height, width, _rgb = pixels.shape
    image = bpy.data.images.new(name, width, height, is_data=is_data)
    image.pixels.foreach_set(np.dstack([pixels, np.ones((height, width))]).astype(np.float32).ravel())
    image.update()
    return image


def link_image(principled, image, socket="Base Color"):
    tree = principled.id_data
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs["Color"], principled.inputs[socket])
    return node


@pytest.mark.parametrize(("roughness", "metallic"), pairs([0.15, 0.3, 0.6, 1.0], [0.0, 1.0], 2))
def test_a_sphere_reflects_as_in_cycles(roughness, metallic, stage, tmp_path):
    ball(Base_Color=(0.5, 0.25, 0.1, 1.0), Roughness=roughness, Metallic=metallic, IOR=1.6)
    sun(math.radians(50.0), 0.0, math.radians(30.0))
    ours, theirs = picture(), by_cycles(tmp_path)
    inside = (ours[..., 3] > 0.999) & (theirs[..., 3] > 0.999)
    np.testing.assert_allclose(ours[inside].mean(axis=0), theirs[inside].mean(axis=0), rtol=0.03)
    error = np.abs(ours - theirs)[inside].mean(axis=0)[:3] / theirs[inside].mean(axis=0)[:3]
    # The smallest highlight is as wide as the normal's change from sample to sample.
    assert error.max() < (0.15 if roughness < 0.2 else 0.05)


def test_a_sphere_in_a_grey_world_is_as_bright_as_in_cycles(stage, tmp_path):
    ball(Base_Color=(0.5, 0.25, 0.1, 1.0), Roughness=0.5)
    world = stage.world = bpy.data.worlds.new("World")
    next(n for n in world.node_tree.nodes if n.type == "BACKGROUND").inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    ours, theirs = picture(), by_cycles(tmp_path)
    inside = (ours[..., 3] > 0.999) & (theirs[..., 3] > 0.999)
    np.testing.assert_allclose(ours[inside].mean(axis=0), theirs[inside].mean(axis=0), rtol=0.03)


def plane(size=2.0):
    """Return a plane that faces the camera, with a UV map; it is active."""
    bpy.ops.mesh.primitive_plane_add(size=size, rotation=(math.pi / 2, 0.0, 0.0))
    return bpy.context.object


def compare(tmp_path, rtol=0.03):
    """Compare a picture with that of Cycles by the means of the whole and of 4 × 4 parts."""
    ours, theirs = (
        p.reshape(4, SIZE // 4, 4, SIZE // 4, 4).mean(axis=(1, 3)) for p in (picture(), by_cycles(tmp_path))
    )
    np.testing.assert_allclose(ours, theirs, rtol=rtol, atol=0.01 * theirs[..., :3].max())
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), theirs.mean(axis=(0, 1)), rtol=rtol)


@pytest.mark.parametrize("placed", ["as it is", "mapped"])
def test_a_plane_has_its_images_colors(placed, stage, rng, tmp_path):
    principled = material_of(plane(), Roughness=0.7)
    node = link_image(principled, image_of(rng.uniform(0.2, 1.0, (8, 8, 3))))
    node.interpolation = "Closest"
    if placed == "mapped":
        tree = principled.id_data
        mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
        mapping.inputs["Location"].default_value = (0.25, 0.125, 0.0)
        mapping.inputs["Rotation"].default_value[2] = math.radians(90.0)
        mapping.inputs["Scale"].default_value = (2.0, 0.5, 1.0)
    sun(math.radians(50.0), 0.0, math.radians(30.0))
    compare(tmp_path)


def test_roughness_and_normals_are_those_of_images(stage, tmp_path):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=0.9)
    bpy.context.object.data.shade_smooth()
    principled = material_of(bpy.context.object, Base_Color=(0.3, 0.3, 0.3, 1.0), Metallic=1.0)
    checks = np.indices((8, 8)).sum(axis=0) % 2
    rough = link_image(principled, image_of(np.repeat(0.4 + 0.3 * checks[..., None], 3, axis=2), "Rough", True))
    u, v = np.meshgrid(np.arange(64), np.arange(64))
    slopes = np.stack([0.4 * np.sin(u / 64 * 8 * math.pi), 0.4 * np.sin(v / 64 * 4 * math.pi), np.ones((64, 64))], -1)
    slopes /= np.linalg.norm(slopes, axis=-1, keepdims=True)
    tree = principled.id_data
    tree.links.new(rough.outputs["Color"], principled.inputs["Roughness"])
    tree.links.remove(principled.inputs["Base Color"].links[0])
    bend = tree.nodes.new("ShaderNodeNormalMap")
    bend.inputs["Strength"].default_value = 0.8
    tree.links.new(bend.outputs["Normal"], principled.inputs["Normal"])
    bumps = link_image(principled, image_of(0.5 * slopes + 0.5, "Normals", True))
    tree.links.new(bumps.outputs["Color"], bend.inputs["Color"])
    tree.links.remove(principled.inputs["Base Color"].links[0])
    sun(math.radians(50.0), 0.0, math.radians(30.0))
    ours, theirs = picture(), by_cycles(tmp_path)
    inside = (ours[..., 3] > 0.999) & (theirs[..., 3] > 0.999)
    assert np.abs(ours - theirs)[inside].mean() < 0.06 * theirs[inside][:, :3].mean()


def test_each_face_has_the_color_of_its_slot(stage):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=1, size=2.0, rotation=(math.pi / 2, 0.0, 0.0))
    grid = bpy.context.object
    for color in ((0.8, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.8, 0.0, 1.0)):
        material_of(grid, Base_Color=color, Specular_IOR_Level=0.0)
    right = max(grid.data.polygons, key=lambda face: face.center.x)
    right.material_index = 2
    sun(math.radians(90.0), 0.0, 0.0, strength=math.pi)
    drawn = picture()
    np.testing.assert_allclose(drawn[:, : SIZE // 2 - 1, :3].mean(axis=(0, 1)), (0.8, 0.0, 0.0), atol=2e-3)
    np.testing.assert_allclose(drawn[:, SIZE // 2 + 1 :, :3].mean(axis=(0, 1)), (0.0, 0.8, 0.0), atol=2e-3)


def test_without_its_image_a_surface_has_its_color_and_says_so_once(stage, tmp_path, capsys):
    notices.printed_cache.clear()
    principled = material_of(plane(), Base_Color=(0.2, 0.4, 0.6, 1.0), Specular_IOR_Level=0.0)
    missing = bpy.data.images.new("Lost", 1, 1)
    missing.source, missing.filepath = "FILE", str(tmp_path / "lost.png")
    link_image(principled, missing)
    sun(math.radians(90.0), 0.0, 0.0, strength=math.pi)
    np.testing.assert_allclose(picture()[..., :3].mean(axis=(0, 1)), (0.2, 0.4, 0.6), atol=2e-3)
    picture()
    assert capsys.readouterr().err.count('The image "Lost" is missing') == 1


def test_a_frame_of_an_unchanged_scene_reads_no_material(stage, monkeypatch):
    link_image(material_of(plane()), image_of(np.full((4, 4, 3), 0.5)))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(stage, bpy.context.view_layer, depsgraph)
    for name in ("read_material", "ImageMap"):
        monkeypatch.setattr(surface_materials, name, None)
    camera = read_camera(stage, depsgraph, SIZE, SIZE)
    for _frame in range(2):
        buffer = visibility_buffer.VisibilityBuffer(SIZE, SIZE)
        scene_drawing.draw(drawn, drawing.view_record(*camera, SIZE), buffer, is_transparent=True)


def test_what_is_behind_a_clear_surface_is_seen_through_its_highlight(stage):
    material_of(plane(4.0), Base_Color=(0.3, 0.3, 0.3, 1.0), Specular_IOR_Level=0.0)
    sun(math.radians(90.0), 0.0, 0.0, strength=math.pi)
    bare = picture()[..., :3]
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.9, location=(0.0, -1.0, 0.0))
    bpy.context.object.data.shade_smooth()
    material_of(bpy.context.object, Transmission_Weight=1.0, Roughness=0.1)
    seen = picture()[..., :3]
    middle = slice(SIZE // 2 - 1, SIZE // 2 + 1)
    assert seen[middle, middle].min() > 2.0 * bare.max()  # the sun, in the sphere
    beside = seen[SIZE // 2, SIZE // 4]
    np.testing.assert_allclose(beside, bare[SIZE // 2, SIZE // 4] * 0.96, rtol=0.05)


def test_surfaces_that_hair_hides_in_part_are_shaded_where_they_are_seen(stage, monkeypatch):
    """Surfaces partly hidden by hair are shaded as without hair beside it, and not at all behind it."""
    material_of(plane(), Base_Color=(0.5, 0.4, 0.3, 1.0))
    clear = plane(0.5)
    clear.location.y = -0.5
    material_of(clear, Transmission_Weight=1.0)
    sun(math.radians(60.0), 0.4, 0.0, strength=math.pi)
    bpy.ops.mesh.primitive_plane_add(size=0.8, rotation=(math.pi / 2, 0.0, 0.0), location=(0.3, -0.1, 0.0))
    bpy.ops.vellus.add_hair(guide_count=20, strand_count=300, length=0.4, radius=0.004)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(stage, bpy.context.view_layer, depsgraph)
    view = drawing.pass_record(*read_camera(stage, depsgraph, 4 * SIZE, 4 * SIZE), (4 * SIZE, 4 * SIZE))
    found, whole = (visibility_buffer.VisibilityBuffer(4 * SIZE, 4 * SIZE) for _ in range(2))
    monkeypatch.setattr(visibility_buffer.VisibilityBuffer, "shade_hair", lambda _buffer: None)
    scene_drawing.draw(drawn, view, found, is_transparent=True)
    monkeypatch.setattr(scene_drawing, "_hair_in_view", lambda *_given, **_options: [])
    scene_drawing.draw(drawn, view, whole, is_transparent=True)
    is_hair = np.array(found.segments.read()).reshape(4 * SIZE, 4 * SIZE) < visibility_buffer.NO_SEGMENT
    colors = [np.array(buffer.color.read(), np.float32).reshape(4 * SIZE, 4 * SIZE, 4) for buffer in (found, whole)]
    assert 0.05 < is_hair.mean() < 0.9
    np.testing.assert_array_equal(*(of[~is_hair] for of in colors))
    assert not colors[0][is_hair].any() and colors[1][is_hair].any()


def test_a_surface_far_behind_hair_is_not_in_its_own_shadow(stage):
    """A surface far behind hair does not shade itself, although the hair's shadow map of the sun contains a part of
    it.
    """
    material_of(plane(4.0), Base_Color=(0.5, 0.5, 0.5, 1.0), Specular_IOR_Level=0.0)
    sun(math.radians(90.0), 0.0, 0.0, strength=math.pi)
    bare = picture()[..., :3]
    plane(0.02).location.y = -1.0
    bpy.ops.vellus.add_hair(guide_count=5, strand_count=5, length=0.3, radius=1e-4)
    found = picture()[..., :3]
    np.testing.assert_allclose(found.mean(), bare.mean(), rtol=0.01)
    assert (found < 0.8 * bare).any(axis=-1).sum() <= 4


def test_a_surface_that_goes_on_behind_the_viewer_is_seen_where_it_is(stage):
    """Each sample of a floor that continues behind a perspective camera has the color of its place."""
    camera = stage.camera
    camera.data.type, camera.data.angle = "PERSP", math.radians(60.0)
    camera.location, camera.rotation_euler = (0.0, 0.0, 1.0), (math.radians(60.0), 0.0, 0.0)
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    width = 512
    ramp = np.repeat(((np.arange(width) + 0.5) / width)[None], 2, axis=0)
    along = image_of(np.stack([ramp, 0.0 * ramp, 1.0 + 0.0 * ramp], axis=-1), is_data=True)
    principled = material_of(bpy.context.object, Specular_IOR_Level=0.0)
    link_image(principled, along)
    sun(0.0, 0.0, 0.0)
    found = picture()
    across, up = np.meshgrid(*[np.tan(math.radians(30.0)) * (2.0 * (np.arange(SIZE) + 0.5) / SIZE - 1.0)] * 2)
    down = math.cos(math.radians(60.0)) - math.sin(math.radians(60.0)) * up  # of the ray through a pixel, at depth one
    is_floor = found[..., 3] == 1.0
    assert 0.5 < is_floor.mean() <= 1.0
    expected = 0.5 + across / np.maximum(down, 0.2) / 20.0
    is_near = is_floor & (np.abs(expected - 0.5) < 0.45) & (down > 0.2)
    np.testing.assert_allclose(found[is_near, 0] / found[is_near, 2], expected[is_near], atol=0.004)


def samples_of(drawn, view, is_coarse, width=4 * SIZE):
    """Return (W, W, 4) samples of a `DrawnScene`, with its surfaces shaded in blocks or not."""
    buffer = visibility_buffer.VisibilityBuffer(width, width, is_coarse=is_coarse)
    scene_drawing.draw(drawn, view, buffer, is_transparent=True)
    return np.array(buffer.color.read(), np.float32).reshape(width, width, 4)


def test_samples_share_light_of_their_own_surface_alone(stage):
    """Samples share light only within one surface: a box, a plane and the background have no light of each other."""
    material_of(plane(1.6), Base_Color=(0.1, 0.2, 0.9, 1.0), Specular_IOR_Level=0.0)
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=(0.0, -1.0, 0.0), rotation=(0.5, 0.2, 0.7))
    material_of(bpy.context.object, Base_Color=(0.9, 0.4, 0.1, 1.0), Specular_IOR_Level=0.0)
    sun(math.radians(60.0), 0.2, 0.0)
    bpy.data.lights["Sun"].use_shadow = False
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(stage, bpy.context.view_layer, depsgraph)
    view = drawing.pass_record(*read_camera(stage, depsgraph, 4 * SIZE, 4 * SIZE), (4 * SIZE, 4 * SIZE), 1)
    shared, alone = (samples_of(drawn, view, is_coarse) for is_coarse in (True, False))
    assert len(np.unique(np.round(alone, 2).reshape(-1, 4), axis=0)) > 4
    np.testing.assert_allclose(shared, alone, atol=2e-3)


def test_slots_of_like_materials_change_nothing(stage):
    """Slots of like materials change nothing, also on a curved surface whose samples share light."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.8)
    ball = bpy.context.object
    ball.data.shade_smooth()
    for _slot in range(3):
        material_of(ball, Base_Color=(0.8, 0.5, 0.2, 1.0), Roughness=0.6)
    sun(math.radians(60.0), 0.0, math.radians(30.0))
    slots = np.random.default_rng(1).integers(0, 3, len(ball.data.polygons)).astype(np.int32)
    seen = []
    for indices in (0 * slots, slots):
        ball.data.polygons.foreach_set("material_index", indices)
        ball.data.update()
        depsgraph = bpy.context.evaluated_depsgraph_get()
        drawn = drawn_scene.read(stage, bpy.context.view_layer, depsgraph)
        view = drawing.pass_record(*read_camera(stage, depsgraph, 4 * SIZE, 4 * SIZE), (4 * SIZE, 4 * SIZE), 1)
        seen.append([samples_of(drawn, view, is_coarse) for is_coarse in (False, True)])
    np.testing.assert_allclose(seen[1][0], seen[0][0], atol=1e-3)
    assert np.abs(seen[1][1] - seen[0][0]).mean() < 3e-3


def test_light_that_samples_share_is_as_bright_below_hair(stage):
    """Shared light of samples below hair is as bright as light of each sample."""
    material_of(plane(), Base_Color=(0.6, 0.5, 0.4, 1.0))
    bpy.ops.mesh.primitive_plane_add(size=0.5, rotation=(math.pi / 2, 0.0, 0.0), location=(0.0, -0.3, 0.0))
    bpy.ops.vellus.add_hair(guide_count=20, strand_count=60, length=0.2, radius=0.004)
    sun(math.radians(70.0), 0.3, 0.0, strength=math.pi)
    bpy.data.objects["Sun"].data.angle = 0.2
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(stage, bpy.context.view_layer, depsgraph)
    camera, means, deviations = read_camera(stage, depsgraph, 4 * SIZE, 4 * SIZE), [], []
    for is_coarse in (True, False):
        passes = [
            samples_of(drawn, drawing.pass_record(*camera, (4 * SIZE, 4 * SIZE), turn), is_coarse) for turn in range(8)
        ]
        means.append(np.mean(passes, axis=0)[..., :3].reshape(SIZE // 4, 16, SIZE // 4, 16, 3).mean(axis=(1, 3)))
        deviations.append(np.std(passes, axis=0).mean())
    np.testing.assert_allclose(means[0].mean(), means[1].mean(), rtol=0.002)
    np.testing.assert_allclose(means[0], means[1], rtol=0.03)
    assert deviations[0] < 1.5 * deviations[1]


@pytest.mark.parametrize(("kind", "has_hair"), pairs(["SUN", "POINT", "SPOT", "AREA"], [False, True], 2))
def test_surfaces_cast_shadows_as_in_cycles(kind, has_hair, stage, fine_shadows, tmp_path):
    """A box casts a shadow on a floor as in Cycles, in each block of 4 × 4 pixels, far from hair in the light of one
    lamp.
    """
    stage.camera.data.ortho_scale = 6.0
    stage.camera.location, stage.camera.rotation_euler = (0.0, -6.0, 6.0), (math.radians(45.0), 0.0, 0.0)
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    floor = bpy.context.object
    material_of(floor, Base_Color=(0.5, 0.5, 0.5, 1.0), Specular_IOR_Level=0.0)
    bpy.ops.mesh.primitive_cube_add(size=1.2, location=(0.8, 0.3, 0.6), rotation=(0.0, 0.0, 0.5))
    material_of(bpy.context.object, Base_Color=(0.2, 0.5, 0.8, 1.0), Specular_IOR_Level=0.0)
    if has_hair:
        bpy.ops.mesh.primitive_plane_add(size=0.1, location=(-1.8, 0.0, 0.05))
        bpy.ops.vellus.add_hair(guide_count=5, strand_count=20, length=0.3, radius=1e-4)
    lamp = bpy.data.lights.new("Lamp", kind)
    lamp.energy = 3.0 if kind == "SUN" else 1000.0
    if kind == "SUN":
        lamp.angle = 0.02
    elif kind == "AREA":
        lamp.size = 0.2
    else:
        lamp.shadow_soft_size = 0.1
    placed = bpy.data.objects.new("Lamp", lamp)
    placed.location, placed.rotation_euler = (3.0, 1.0, 3.0), (0.0, math.radians(45.0), 0.0)
    stage.collection.objects.link(placed)
    blocks = [of.reshape(12, 4, 12, 4, 4).mean(axis=(1, 3))[..., :3] for of in (picture(), by_cycles(tmp_path))]
    apart = np.abs(blocks[0] - blocks[1])
    assert apart.mean() < (0.03 if kind == "SPOT" else 0.01) * blocks[1].mean()  # a spot's border is another
    assert apart.max() < 0.1 * blocks[1].max()
