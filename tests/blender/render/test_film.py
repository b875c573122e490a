# SPDX-License-Identifier: GPL-3.0-or-later
"""The passes of the render engine are parts of the light, depth, and motion vectors."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.scene import read_camera
from hair_addon.blender.render import film
from tests.support.pairs import pairs
from tests.support.pictures.rendering import configure, layers_of, light_up, rendered
from tests.support.reading import evaluated_points

MODELS = [("KAJIYA_KAY", "energy"), ("MARSCHNER", "energy"), ("MARSCHNER", "classic")]


@pytest.mark.parametrize(("model_mode", "is_varied"), pairs(MODELS, [False, True], 2))
def test_the_lobes_add_up_to_the_light_of_hair(lit, tmp_path, model_mode, is_varied):
    """The lobes add up to the light of hair under a sun, a world and a reflecting surface, for each model and varied
    strands.
    """
    light_up()
    state, (model, mode) = lit.data.vellus, model_mode
    state.model, state.appearance.mode, state.marschner.size = model, mode, 64
    if is_varied:
        state.appearance.random_color = state.appearance.random_roughness = 0.4
    bpy.data.objects["Sphere"].is_holdout = True
    bpy.context.view_layer.vellus.has_lobes = True
    passes = rendered(tmp_path, film_transparent=True)
    lobes = {name: passes[name] for name in film.LOBES}
    total = sum(lobes.values())
    light = passes["Combined"][..., :3]
    np.testing.assert_allclose(total, light, atol=2e-3 * light.max())
    assert total.mean() == pytest.approx(light.mean(), rel=1e-3)
    is_there = {name: lobe.mean() > 1e-3 * light.mean() for name, lobe in lobes.items()}
    assert is_there["Hair R"] and is_there["Hair World"] and is_there["Hair Scattered"]
    assert is_there["Hair TRT"] == (model == "MARSCHNER")


def test_a_holdout_leaves_a_hole_in_the_shape_of_the_surface(lit, tmp_path):
    bpy.context.view_layer.vellus.has_hair_mask = True
    seen = rendered(tmp_path, film_transparent=True)
    bpy.data.objects["Sphere"].is_holdout = True
    held_out = rendered(tmp_path)
    np.testing.assert_allclose(held_out["Hair Mask"], seen["Hair Mask"], atol=1e-6)
    np.testing.assert_allclose(held_out["Combined"][..., 3], seen["Hair Mask"], atol=1e-6)
    assert seen["Combined"][..., 3].mean() > 2.0 * held_out["Combined"][..., 3].mean()


def test_shadow_is_the_part_of_light_that_arrives(lit, tmp_path):
    """On a matte surface under one sun, the shadow pass is the remaining fraction of the light in each sample."""
    sun = next(o for o in bpy.data.objects if o.type == "LIGHT")
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 2.0, 0.0), rotation=(math.pi / 2, 0.0, 0.0))
    bpy.context.view_layer.use_pass_shadow = bpy.context.view_layer.vellus.has_hair_mask = True
    shaded = rendered(tmp_path, film_transparent=True, sample_count=1)
    sun.data.use_shadow = False
    open_to_light = rendered(tmp_path, sample_count=1)
    is_surface = shaded["Hair Mask"] == 0.0
    faces_light = is_surface & (open_to_light["Shadow"].min(axis=-1) > 0.99)
    arriving = shaded["Combined"][..., :3] / np.maximum(open_to_light["Combined"][..., :3], 1e-6)
    # Hair also sends light to where the sun grazes a surface, which is no shadow.
    off = np.abs(shaded["Shadow"][faces_light] - np.minimum(arriving[faces_light], 1.0))
    # A rasterized place differs from that of a ray by up to 1/512 pixel. At the border of the hair in its map, this
    # changes one of the four lookups of a sample.
    assert np.quantile(off, 0.995) < 5e-3 and off.max() <= 0.25 and off.mean() < 2e-4
    assert shaded["Shadow"][faces_light].min() < 0.1 and shaded["Shadow"][faces_light].max() == 1.0
    is_hair = shaded["Hair Mask"] > 0.9
    assert is_hair.any() and shaded["Shadow"][is_hair].min() < 0.5
    assert (open_to_light["Shadow"][is_hair] > 0.89).all()


def test_depth_is_the_distance_along_the_view(scene, tmp_path):
    """Depth is as in Cycles: constant on a plane across the view, and 1e10 for the background."""
    bpy.ops.object.camera_add(location=(0.0, 0.0, 5.0))
    scene.camera = bpy.context.object
    bpy.ops.mesh.primitive_plane_add(size=2.0, rotation=(0.0, math.pi / 4, 0.0))
    bpy.context.view_layer.use_pass_z = True
    ours = rendered(tmp_path)["Depth"]
    scene.cycles.samples, scene.cycles.device = 1, "CPU"
    theirs = rendered(tmp_path, engine="CYCLES")["Depth"]
    is_there = (ours < 1e9) & (theirs < 1e9)
    assert is_there.sum() > 300 and (is_there != (theirs < 1e9)).mean() < 0.02
    step = 10.0 / scene.render.resolution_x  # of a slanted plane, in a pixel; the nearest of its samples counts
    np.testing.assert_allclose(ours[is_there], theirs[is_there], atol=step)
    assert np.ptp(ours[is_there]) > 1.0
    assert (ours[~is_there & (theirs > 1e9)] == np.float32(1e10)).mean() > 0.98


def moving(surface):
    """Return a camera and a surface that move through frames 1 to 3, with frame 2 as the current one."""
    scene = bpy.context.scene
    surface.rotation_mode = "XYZ"
    for frame, place, turn, seen_from in (
        (1, (0.0, 0.0, 0.0), 0.0, (0.0, -8.0, 0.0)),
        (2, (0.2, 0.0, 0.1), 0.2, (0.1, -8.0, 0.0)),
        (3, (0.5, 0.5, 0.1), 0.5, (0.1, -7.0, 0.3)),
    ):
        surface.location, surface.rotation_euler.z, scene.camera.location = place, turn, seen_from
        for thing, path in ((surface, "location"), (surface, "rotation_euler"), (scene.camera, "location")):
            thing.keyframe_insert(path, frame=frame)
    scene.frame_set(2)


def seen_points(curves_object, frame, size):
    """Return (N, 3) positions of points on strands in a frame's picture [pixels], and their distances along the
    view's axis.
    """
    scene = bpy.context.scene
    scene.frame_set(frame)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    to_view, to_clip = read_camera(scene, depsgraph, *size)
    strands = evaluated_points(curves_object)
    part = np.linspace(0.0, 1.0, 12, endpoint=False)[:, None]
    dense = (strands[:, :-1, None] * (1.0 - part) + strands[:, 1:, None] * part).reshape(-1, 3)
    viewed = np.c_[dense, np.ones(len(dense))] @ (to_view @ np.array(curves_object.matrix_world)).T
    clip = viewed @ to_clip.T
    return np.c_[(0.5 * clip[:, :2] / clip[:, 3:] + 0.5) * size, -viewed[:, 2]]


def test_vectors_of_hair_lead_to_the_frame_before_and_from_the_frame_after(lit, tmp_path):
    """In each sample the vectors are those of its point on the strand, with a moving surface and camera."""
    moving(bpy.data.objects["Sphere"])
    view_layer = bpy.context.view_layer
    view_layer.use_pass_vector = view_layer.use_pass_z = view_layer.vellus.has_hair_mask = True
    passes = rendered(tmp_path, sample_count=1, film_transparent=True)
    size = passes["Combined"].shape[1::-1]
    assert bpy.context.scene.frame_current == 2
    before, now, after = (seen_points(lit, frame, size) for frame in (1, 2, 3))
    rows, columns = np.nonzero(passes["Hair Mask"])
    depths = passes["Depth"][rows, columns]
    shown = [
        np.argmin(np.sum((now - (x + 0.5, y + 0.5, depth)) ** 2 * (1.0, 1.0, 1e4), axis=1))
        for x, y, depth in zip(columns, rows, depths, strict=True)
    ]
    expected = np.c_[before[shown, :2] - now[shown, :2], now[shown, :2] - after[shown, :2]]
    error = np.abs(passes["Vector"][rows, columns] - expected).max(axis=1)
    # A sample's point on the strand is known to a quarter of a segment.
    assert np.median(error) < 0.05 and np.quantile(error, 0.95) < 0.25
    assert np.abs(expected).max() > 5.0


def test_vectors_are_those_of_cycles(lit, tmp_path):
    moving(bpy.data.objects["Sphere"])
    lit.hide_render = True
    bpy.context.view_layer.use_pass_vector = True
    ours = rendered(tmp_path, film_transparent=True, sample_count=16)["Vector"]
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.device = 16, "CPU"
    theirs = rendered(tmp_path, engine="CYCLES")["Vector"]
    is_there = np.abs(theirs).max(axis=-1) > 0.0
    assert is_there.sum() > 300
    error = np.abs(ours - theirs)[is_there]
    assert np.median(error) < 0.03 and error.mean() < 0.3
    assert (ours[~is_there] == 0.0).mean() > 0.97


def test_what_is_blurred_already_has_no_vectors(lit, tmp_path):
    bpy.context.view_layer.use_pass_vector = True
    assert "Vector" not in rendered(tmp_path, use_motion_blur=True, motion_steps=2)
    bpy.context.scene.render.use_motion_blur = False


def test_passes_are_sockets_of_the_compositor_which_lays_hair_over_a_backdrop(lit, tmp_path):
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    configure(sample_count=16, film_transparent=True)
    view_layer.use_pass_shadow = view_layer.vellus.has_hair_mask = view_layer.vellus.has_lobes = True
    tree = bpy.data.node_groups.new("Composite", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, over, output = map(tree.nodes.new, ("CompositorNodeRLayers", "CompositorNodeAlphaOver", "NodeGroupOutput"))
    over.inputs["Background"].default_value = (0.2, 0.5, 0.1, 1.0)
    tree.links.new(layers.outputs["Image"], over.inputs["Foreground"])
    tree.links.new(over.outputs["Image"], output.inputs["Image"])
    scene.compositing_node_group = tree
    assert {"Shadow", "Hair Mask", *film.LOBES} <= {socket.name for socket in layers.outputs if socket.enabled}
    found = layers_of(tmp_path, sample_count=16)
    rendered_alone, composite = found["ViewLayer"]["Combined"], found["Composite"]["Combined"]
    expected = rendered_alone[..., :3] + (1.0 - rendered_alone[..., 3:]) * (0.2, 0.5, 0.1)
    np.testing.assert_allclose(composite[..., :3], expected, atol=1.0 / 255.0)
