# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of data have Cycles' values of position, mist, normal and colors without light, and data for denoising."""

import math

import bpy
import numpy as np
import OpenEXR
import pytest

from hair_addon import api
from hair_addon.blender.data.scene import read_camera
from hair_addon.blender.render import data_passes, film
from tests.support.pictures.rendering import configure, layers_of, read_layers, rendered

SIZE = {"resolution_x": 48, "resolution_y": 36}
NAMES = (*data_passes.SETTINGS.values(), *data_passes.DENOISING[1:])


def straighten(hair, starts, ends, radius):
    """Replace the strands of a hair by straight strands from `starts` to `ends`, (N, 3) each, of one radius, and stop
    its updates.
    """
    hair.data.vellus.hair.strand_count = len(starts)
    bpy.context.view_layer.update()
    hair.data.vellus.is_live = False
    along = np.linspace(0.0, 1.0, len(hair.data.points) // len(hair.data.curves))[:, None]
    places = starts[:, None] * (1.0 - along) + ends[:, None] * along
    hair.data.attributes["position"].data.foreach_set("vector", places.ravel().astype(np.float32))
    hair.data.attributes["radius"].data.foreach_set("value", np.full(len(hair.data.points), radius, np.float32))
    hair.data.update_tag()
    bpy.context.view_layer.update()


@pytest.fixture
def described(lit):
    """Return three straight strands a few pixels wide before a slanted plane of colored metal, seen obliquely, in
    mist.
    """
    scene, layer = bpy.context.scene, bpy.context.view_layer
    bpy.data.objects["Sphere"].hide_render = True
    starts = np.array([(-0.7, 0.0, -0.9), (0.0, -0.2, 0.6), (1.0, -0.4, -0.5)])
    ends = np.array([(-0.3, 0.3, 0.9), (1.1, 0.2, 0.5), (0.1, 0.0, -0.7)])
    straighten(lit, starts, ends, radius=0.15)
    bpy.ops.mesh.primitive_plane_add(size=2.4, location=(0.2, 1.0, 0.0), rotation=(1.2, 0.3, 0.2))
    metal = bpy.data.materials.new("Metal")
    principled = metal.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value, principled.inputs["Metallic"].default_value = (0.2, 0.5, 0.7, 1), 0.3
    bpy.context.object.data.materials.append(metal)
    camera = scene.camera
    camera.location, camera.rotation_euler = (1.5, -6.0, 1.0), (1.42, 0.05, 0.24)
    camera.data.lens, camera.data.ortho_scale = 70.0, 3.2
    scene.world = bpy.data.worlds.new("Fog")
    mist = scene.world.mist_settings
    mist.start, mist.depth, mist.falloff = 4.5, 4.0, "QUADRATIC"
    for name in ("use_pass_z", *data_passes.SETTINGS):
        setattr(layer, name, True)
    layer.vellus.has_denoising_data = layer.vellus.has_hair_mask = True
    return lit


def by_cycles(folder, hair, **settings):
    """Return the passes of Cycles; hair is matte, as the normals of hair shaders point to the side of strands."""
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.device, scene.cycles.pixel_filter_type = 64, "CPU", "BOX"
    scene.cycles.use_denoising, scene.cycles.max_bounces = False, 0
    bpy.context.view_layer.cycles.denoising_store_passes = True
    matte = bpy.data.materials.new("Matte")
    nodes = matte.node_tree.nodes
    nodes.clear()
    output, shader = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeBsdfDiffuse")
    matte.node_tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    hair.data.materials.clear()
    hair.data.materials.append(matte)
    return rendered(folder, engine="CYCLES", **SIZE, **settings)


def inside(mask):
    """Whether a pixel and its neighbors are in a mask."""
    return np.logical_and.reduce([np.roll(mask, by, (0, 1)) for by in ((0, 0), (0, 1), (0, -1), (1, 0), (-1, 0))])


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "mirrored"])
def test_values_are_those_of_cycles(described, tmp_path, kind):
    """On a surface and on strands all passes equal Cycles'; outside, position and normal are 0 and mist is 1."""
    camera = bpy.context.scene.camera
    camera.data.type = "PERSP" if kind == "mirrored" else kind
    camera.scale.x = -1.0 if kind == "mirrored" else 1.0
    ours = rendered(tmp_path, sample_count=64, film_transparent=True, **SIZE)
    theirs = by_cycles(tmp_path, described)
    covered, alpha = ours["Hair Mask"], ours["Combined"][..., 3]
    masks = covered == 1.0, (covered == 0.0) & (alpha == 1.0), alpha == 0.0
    hair, surface, nothing = map(inside, masks)
    assert min(hair.sum(), surface.sum(), nothing.sum()) > 30
    for name in NAMES:
        error = np.abs(ours[name] - theirs[name]) / np.ptp(theirs[name])
        assert np.quantile(error[surface], 0.95) < 0.02, name
        if name == "UV":
            assert np.ptp(theirs[name][hair], axis=0)[0] > 0.05
        if name == "Denoising Albedo":
            continue  # Cycles has the color of the background, and the hair's material is another
        assert error[nothing].max() < 1e-4, name
        if name != "Diffuse Color":
            assert np.quantile(error[hair], 0.9) < 0.04 and np.median(error[hair]) < 0.015, name
    assert not ours["Diffuse Color"][hair].any()
    assert 0.05 < ours["Mist"].min() < 0.5 and np.all(ours["Denoising Albedo"][hair] > 0.02)


def distances(name, places):
    """Return distances of positions along the view axis or from a panoramic camera, `FAR` where the position is 0."""
    scene = bpy.context.scene
    to_view, _ = read_camera(scene, bpy.context.evaluated_depsgraph_get(), 48, 36)
    seen = places @ to_view[:3, :3].T + to_view[:3, 3]
    found = np.linalg.norm(seen, axis=-1) if name == "panorama" else -seen[..., 2]
    return np.where(places.any(axis=-1), found, film.FAR)


@pytest.mark.parametrize("how", ["panorama", "lens", "motion blur", "tiles"])
def test_positions_are_at_the_depths(described, tmp_path, monkeypatch, how):
    """With each way of sampling, the position of a pixel is as far away as its depth."""
    scene = bpy.context.scene
    if how == "panorama":
        scene.camera.data.type, scene.camera.data.panorama_type = "PANO", "FISHEYE_EQUIDISTANT"
        scene.camera.data.fisheye_fov = 0.7
    elif how == "lens":
        scene.camera.data.dof.use_dof, scene.camera.data.dof.focus_distance = True, 4.0
        scene.camera.data.dof.aperture_fstop = 0.5
    elif how == "motion blur":
        for frame, place in ((0, -0.3), (2, 0.3)):
            described.location.x = place
            described.keyframe_insert("location", frame=frame)
    else:
        whole = rendered(tmp_path, **SIZE)
        monkeypatch.setattr(film, "_MOST_SAMPLES", 60)
    found = rendered(tmp_path, use_motion_blur=how == "motion blur", motion_steps=3, **SIZE)
    expected, depths = distances(how, found["Position"]), found["Depth"]
    assert 0.2 < (depths < film.FAR).mean() < 0.95
    np.testing.assert_array_equal(expected == film.FAR, depths >= 0.999 * film.FAR)
    is_near = expected < film.FAR
    np.testing.assert_allclose(expected[is_near], depths[is_near], rtol=1e-2)
    if how == "tiles":
        for name in NAMES:
            np.testing.assert_allclose(found[name], whole[name], atol=2e-3, err_msg=name)
    scene.render.use_motion_blur = False


def test_holdouts_are_empty(described, tmp_path):
    for mesh_object in [one for one in bpy.context.scene.objects if one.type == "MESH"]:
        mesh_object.is_holdout = True
    found = rendered(tmp_path, film_transparent=True, **SIZE)
    empty = found["Hair Mask"] == 0.0
    assert 0.2 < empty.mean() < 0.9
    assert np.all(found["Mist"][empty] == 1.0)
    for name in set(NAMES) - {"Mist"}:
        assert not found[name][empty].any(), name
        assert name == "Diffuse Color" or found[name].any(axis=-1)[~empty].mean() > 0.9, name


@pytest.mark.parametrize("depth", ["16", "32"])
def test_files_have_the_channels_of_cycles(described, tmp_path, depth):
    """Channels have Cycles' names and the scene's number of bits."""

    def channels(engine):
        configure(engine=engine, filepath=str(tmp_path / "passes.exr"), sample_count=1, **SIZE)
        image = bpy.context.scene.render.image_settings
        image.media_type, image.color_depth = "MULTI_LAYER_IMAGE", depth
        bpy.ops.render.render(write_still=True)
        with OpenEXR.File(str(tmp_path / "passes.exr"), separate_channels=True) as file:
            found = {name: one.pixels.dtype for part in file.parts for name, one in part.channels.items()}
        return {name: kind for name, kind in found.items() if name.split(".")[1] in NAMES}

    bpy.context.scene.cycles.samples, bpy.context.scene.cycles.device = 1, "CPU"
    bpy.context.view_layer.cycles.denoising_store_passes = True
    ours, theirs = channels("VELLUS"), channels("CYCLES")
    assert len(ours) == 19 and ours.items() <= theirs.items()
    assert str(ours["ViewLayer.Diffuse Color.R"]) == f"float{depth}"


def test_all_passes_of_a_written_frame_include_them(lit, tmp_path):
    """With `render --passes`, each pass is a layer of the file, and the settings of the view layer stay."""
    layer = bpy.context.view_layer
    api.render(tmp_path / "passes.exr", has_passes=True, width=16, height=12, sample_count=1)
    (written,) = read_layers(tmp_path / "passes.exr").values()
    assert written.keys() >= {*NAMES, *data_passes.DENOISING}
    assert not layer.use_pass_position and not layer.vellus.has_denoising_data


def test_the_denoise_node_removes_noise(thin, tmp_path):
    """Blender's Denoise node brings the noisy image closer to a picture of many samples."""
    scene = bpy.context.scene
    bpy.context.view_layer.vellus.has_denoising_data = True
    configure(**SIZE)
    bpy.context.view_layer.update_render_passes()
    tree = bpy.data.node_groups.new("Denoised", "CompositorNodeTree")
    tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    layers, denoise, output = map(tree.nodes.new, ("CompositorNodeRLayers", "CompositorNodeDenoise", "NodeGroupOutput"))
    for source, target in (("Noisy Image", "Image"), ("Denoising Albedo", "Albedo"), ("Denoising Normal", "Normal")):
        tree.links.new(layers.outputs[source], denoise.inputs[target])
    tree.links.new(denoise.outputs["Image"], output.inputs["Image"])
    noisy, clean = (layers_of(tmp_path, sample_count=count, **SIZE)["ViewLayer"] for count in (1, 64))
    np.testing.assert_array_equal(noisy["Noisy Image"], noisy["Combined"])
    scene.compositing_node_group = tree
    denoised = layers_of(tmp_path, sample_count=1, **SIZE)["Composite"]["Combined"]
    errors = [np.mean((one - clean["Combined"])[..., :3] ** 2) for one in (denoised, noisy["Combined"])]
    assert errors[0] < 0.5 * errors[1]


def test_a_flat_picture_of_mist_is_that_of_the_distance(described, tmp_path):
    """Mist is a power, by the falloff of the world, of the distance beyond its start relative to its depth."""
    settings = bpy.context.scene.world.mist_settings
    for falloff, exponent in (("LINEAR", 1.0), ("INVERSE_QUADRATIC", 0.5)):
        settings.falloff = falloff
        found = rendered(tmp_path, sample_count=16, **SIZE)
        away = np.linalg.norm(found["Position"] - np.array(bpy.context.scene.camera.location), axis=-1)
        surface = inside(found["Position"].any(axis=-1) & (found["Hair Mask"] == 0.0))
        expected = np.clip((away - settings.start) / settings.depth, 0.0, 1.0) ** exponent
        assert math.isclose(np.median(np.abs(found["Mist"] - expected)[surface]), 0.0, abs_tol=0.01)
