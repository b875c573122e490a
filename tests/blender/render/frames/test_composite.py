# SPDX-License-Identifier: GPL-3.0-or-later
"""Composite Hair shows surfaces by Cycles or EEVEE and hair by Vellus in one picture, and can be turned off
completely.
"""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import curves_objects
from hair_addon.blender.host import scene_time
from hair_addon.blender.render.frames import composite
from tests.support.pictures.rendering import configure, light_up, rendered

RAYS = [f"visible_{ray}" for ray in curves_objects._RAYS]


@pytest.fixture
def cycles(lit):
    """Return the hairy sphere with fast settings of Cycles."""
    scene = bpy.context.scene
    lit.data.vellus.hair.strand_count, lit.data.vellus.hair.radius = 4000, 0.01
    configure(engine="CYCLES", resolution_x=64, resolution_y=48)
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.pixel_filter_type = 16, False, "BOX"
    scene.vellus.sample_count = 16
    scene.render.film_transparent = True
    light_up((0.1, 0.1, 0.1))
    return lit


def picture(folder, name="picture", **settings):
    """Return (height, width, 4), linear and premultiplied, of the scene after its compositor."""
    render = bpy.context.scene.render
    for key, value in settings.items():
        setattr(render, key, value)
    render.image_settings.media_type, render.image_settings.file_format = "IMAGE", "OPEN_EXR"
    render.image_settings.color_mode, render.image_settings.color_depth = "RGBA", "32"
    render.filepath = str(folder / f"{name}.exr")
    bpy.ops.render.render(write_still=True)
    return pixels_of(render.filepath)


def pixels_of(path):
    image = bpy.data.images.load(path)
    width, height = image.size
    pixels = np.empty((height, width, 4), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    bpy.data.images.remove(image)
    return pixels


def state():
    """Return the parts of the file that the button may change, by name."""
    trees = [(tree.name, sorted(node.name for node in tree.nodes), links_of(tree)) for tree in bpy.data.node_groups]
    objects = [(o.name, [getattr(o, ray) for ray in RAYS], sorted(o.keys())) for o in bpy.data.objects]
    scene = bpy.context.scene
    group = scene.compositing_node_group
    return trees, objects, [*bpy.data.scenes.keys()], scene.render.use_compositing, group and group.name


def set_shutter(mapping, places):
    """Set the shutter curve by points (time, opening)."""
    points = mapping.curves[0].points
    while len(points) > 2:
        points.remove(points[1])
    for place in places[2:]:
        points.new(*place)
    for point, place in zip(points, places, strict=True):
        point.location = place
    mapping.update()


def links_of(tree):
    return sorted(
        (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
        for link in tree.links
    )


def test_it_is_vellus_hair_over_shaded_surfaces(cycles, tmp_path):
    """The compositor combines the pictures of both engines as surfaces × shadow × (1 - alpha) + hair."""
    scene = bpy.context.scene
    view_layer = bpy.context.view_layer
    scene.vellus.is_hair_only = view_layer.vellus.has_hair_shadow = True
    passes = rendered(tmp_path, film_transparent=True, resolution_x=64, resolution_y=48, sample_count=16)
    scene.vellus.is_hair_only = view_layer.vellus.has_hair_shadow = False
    hair, shadow = passes["Combined"], passes["Hair Shadow"]
    assert (shadow <= 1.0 + 1e-5).all() and 0.1 < shadow.min() < 0.6 and shadow.max() == pytest.approx(1.0)
    for ray in RAYS:
        setattr(cycles, ray, False)
    surfaces = picture(tmp_path, engine="CYCLES")
    for ray in RAYS:
        setattr(cycles, ray, True)
    bpy.ops.vellus.toggle_composite()
    found = picture(tmp_path)
    shaded = np.concatenate([surfaces[..., :3] * shadow, surfaces[..., 3:]], axis=-1)
    np.testing.assert_allclose(found, shaded * (1.0 - hair[..., 3:]) + hair, atol=2e-3)
    assert np.abs(found - surfaces).max() > 0.3


def test_on_a_floor_the_shadow_is_as_dark_as_by_cycles(cycles, tmp_path):
    """The darkest part of a hair's shadow on a floor is as dark as by Cycles, within a tenth."""
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=12.0, location=(0.0, 0.0, -1.6))
    scene.camera.location, scene.camera.rotation_euler = (0.0, -7.0, 4.0), (1.1, 0.0, 0.0)
    bpy.data.objects["Sun"].rotation_euler = (0.0, 0.5, 0.0)
    whole = picture(tmp_path, engine="CYCLES")
    bpy.ops.vellus.toggle_composite()
    shaded = picture(tmp_path)
    scene.vellus.composite_shadow = "NONE"
    bpy.context.view_layer.update()
    bare = picture(tmp_path)
    darkest = (shaded - bare)[..., 1] < -0.15 * bare[..., 1]
    assert darkest.sum() > 30
    assert whole[darkest].mean() < 0.8 * bare[darkest].mean()
    assert shaded[darkest].mean() == pytest.approx(whole[darkest].mean(), rel=0.1)


def test_surfaces_hide_hair_and_are_not_seen_in_hair_only(cycles, tmp_path):
    view_layer = bpy.context.view_layer
    view_layer.vellus.has_hair_mask = True
    whole = rendered(tmp_path, film_transparent=True)
    bpy.context.scene.vellus.is_hair_only = True
    alone = rendered(tmp_path)
    np.testing.assert_array_equal(alone["Hair Mask"], whole["Hair Mask"])
    np.testing.assert_allclose(alone["Combined"][..., 3], alone["Hair Mask"], atol=1e-5)
    only_hair = whole["Hair Mask"] > 0.999
    assert only_hair.sum() > 20
    np.testing.assert_allclose(alone["Combined"][only_hair], whole["Combined"][only_hair], atol=1e-4)


def test_a_second_press_leaves_everything_as_before(cycles, tmp_path):
    cycles.visible_glossy = False  # an artist's choice
    before = state()
    bpy.ops.vellus.toggle_composite()
    assert bpy.context.scene.vellus.hair_scene is not None and state() != before
    bpy.ops.vellus.toggle_composite()
    assert state() == before


def test_after_a_save_it_is_still_undone(cycles, tmp_path):
    before = state()
    bpy.ops.vellus.toggle_composite()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "composited.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "composited.blend"))
    assert bpy.context.scene.vellus.hair_scene.background_set == bpy.context.scene
    bpy.ops.vellus.toggle_composite()
    assert state() == before


def test_undo_takes_it_back(cycles):
    bpy.ops.ed.undo_push(message="before")
    before = state()
    bpy.ops.vellus.toggle_composite("EXEC_DEFAULT", True)
    on = state()
    bpy.ops.ed.undo()
    assert state() == before
    bpy.ops.ed.redo()
    assert state() == on
    bpy.ops.vellus.toggle_composite("EXEC_DEFAULT", True)
    assert state() == before


def test_an_artist_s_compositor_works_on_hair_too(cycles, tmp_path):
    scene = bpy.context.scene
    tree = scene.compositing_node_group = bpy.data.node_groups.new("Artist's", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    source, invert, output = map(tree.nodes.new, ("CompositorNodeRLayers", "CompositorNodeExposure", "NodeGroupOutput"))
    invert.inputs["Exposure"].default_value = 1.0
    tree.links.new(source.outputs["Image"], invert.inputs["Image"])
    tree.links.new(invert.outputs["Image"], output.inputs["Image"])
    before = state()
    bpy.ops.vellus.toggle_composite()
    brighter = picture(tmp_path)
    invert.inputs["Exposure"].default_value = 0.0
    np.testing.assert_allclose(brighter[..., :3], 2.0 * picture(tmp_path)[..., :3], rtol=1e-3, atol=1e-5)
    bpy.ops.vellus.toggle_composite()
    assert state() == before


def test_the_hair_s_scene_follows(cycles):
    """The scene of the hair follows camera, size, exposure, samples, shutter curve and Time Stretching, and hair that
    is added later.
    """
    scene = bpy.context.scene
    bpy.ops.vellus.toggle_composite()
    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    scene.collection.objects.link(other)
    scene.camera, scene.render.resolution_x, scene.render.use_motion_blur = other, 33, True
    scene.vellus.sample_count = 9
    scene.render.frame_map_old, scene.render.frame_map_new = 50, 200
    scene.timeline_markers.new("Cut", frame=7).camera = other
    late = bpy.data.objects.new("Late", cycles.data)
    scene.collection.objects.link(late)
    bpy.context.view_layer.update()
    hair_scene = scene.vellus.hair_scene
    assert (hair_scene.camera, hair_scene.render.resolution_x, hair_scene.vellus.sample_count) == (other, 33, 9)
    assert hair_scene.render.use_motion_blur
    assert scene_time.remapping(hair_scene) == scene_time.remapping(scene) == 0.25
    for places in ([(0.0, 0.0), (0.3, 1.0), (0.6, 0.5), (1.0, 0.25)], [(0.0, 1.0), (1.0, 0.5)]):
        set_shutter(scene.render.motion_blur_shutter_curve, places)
        composite.follow(scene)
        opened = hair_scene.render.motion_blur_shutter_curve.curves[0].points
        np.testing.assert_allclose([point.location for point in opened], places, atol=1e-6)
    assert [(m.frame, m.camera) for m in hair_scene.timeline_markers] == [(7, other)]
    assert not late.visible_camera
    scene.vellus.composite_shadow = "ENGINE"
    bpy.context.view_layer.update()
    assert late.visible_shadow and not late.visible_camera
    bpy.ops.vellus.toggle_composite()
    assert late.visible_camera


def test_each_frame_of_an_animation_has_its_hair(arm, tmp_path, monkeypatch):
    """Each frame of an animation has its hair on the deformed surface, the camera of its marker and its keyed shutter,
    also in a window without Lock Interface, in which a render updates no viewport.
    """
    monkeypatch.setattr(scene_time, "may_write", lambda _scene, depsgraph: scene_time.is_shown(depsgraph))
    scene = bpy.context.scene
    scene.render.use_motion_blur, scene.vellus.motion_steps = True, 2
    for frame, shutter in ((1, 0.0), (11, 2.0)):
        scene.render.motion_blur_shutter = shutter
        scene.render.keyframe_insert("motion_blur_shutter", frame=frame)
    bpy.context.view_layer.objects.active = arm
    bpy.ops.vellus.add_hair(guide_count=60, strand_count=600, length=0.3, radius=0.01)
    for name, location in (("Camera", (0.0, 0.0, 9.0)), ("Cut", (0.0, 1.0, 12.0))):
        camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
        camera.location = location
        scene.collection.objects.link(camera)
        scene.timeline_markers.new(name, frame=1 if name == "Camera" else 11).camera = camera
    scene.camera = bpy.data.objects["Camera"]
    bpy.ops.object.light_add(type="SUN")
    arm.visible_camera = False  # what Cycles sees is empty: the picture is the hair
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 11, 10
    configure(engine="CYCLES", film_transparent=True, resolution_x=64, resolution_y=48)
    scene.cycles.samples = 1
    scene.frame_set(1)
    bpy.ops.vellus.toggle_composite()
    render = scene.render
    render.image_settings.media_type, render.image_settings.file_format = "IMAGE", "OPEN_EXR"
    render.image_settings.color_mode, render.image_settings.color_depth = "RGBA", "32"
    render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    found = {frame: pixels_of(str(tmp_path / f"frame_{frame:04}.exr")) for frame in (1, 11)}
    bpy.ops.vellus.toggle_composite()
    scene.vellus.is_hair_only = True
    for frame, pixels in found.items():
        scene.frame_set(frame)
        alone = rendered(tmp_path, film_transparent=True, resolution_x=64, resolution_y=48)["Combined"]
        np.testing.assert_allclose(pixels, alone, atol=2e-3)
    assert np.abs(found[1] - found[11]).mean() > 0.1 * np.abs(found[1]).mean()


def test_by_vellus_itself_hair_is_not_laid_over_twice(cycles, tmp_path):
    bpy.ops.vellus.toggle_composite()
    found = picture(tmp_path, engine="VELLUS")
    bpy.context.scene.render.use_compositing = False
    np.testing.assert_allclose(found, picture(tmp_path), atol=1e-5)


def test_it_refuses_in_one_sentence(cycles):
    scene = bpy.context.scene
    scene.render.engine = "VELLUS"
    with pytest.raises(RuntimeError, match="choose Cycles or EEVEE"):
        bpy.ops.vellus.toggle_composite()
    scene.render.engine = "CYCLES"
    scene.compositing_node_group = bpy.data.node_groups.new("Empty", "CompositorNodeTree")
    before = state()
    with pytest.raises(RuntimeError, match="Render Layers"):
        bpy.ops.vellus.toggle_composite()
    assert state() == before


def test_without_its_scene_it_is_still_taken_away(cycles):
    before = state()
    bpy.ops.vellus.toggle_composite()
    bpy.data.scenes.remove(bpy.context.scene.vellus.hair_scene)
    bpy.ops.vellus.toggle_composite()
    assert state() == before
