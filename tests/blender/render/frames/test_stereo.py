# SPDX-License-Identifier: GPL-3.0-or-later
"""Stereo pictures show both eyes as Cycles does, in the files that Blender writes."""

import bpy
import numpy as np
import OpenEXR
import pytest

from hair_addon.blender.render.frames import composite
from tests.support.pairs import share_of_rows
from tests.support.pictures.rendering import configure, rendered

WIDTH, HEIGHT = 96, 72


@pytest.fixture
def pair(lit):
    """Return the hairy sphere near to two eyes far apart."""
    scene = bpy.context.scene
    scene.camera.location.y = -5.0
    stereo = scene.camera.data.stereo
    stereo.interocular_distance, stereo.convergence_distance = 0.6, 4.0
    scene.render.use_multiview = scene.render.film_transparent = True
    lit.data.vellus.hair.radius = 0.02
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 16, False, 0
    scene.cycles.pixel_filter_type = "BOX"
    return scene


def views(folder, suffixes=("_L", "_R"), **settings):
    """Return [(height, width, 4)] of each view, from individual files."""
    configure(**{"resolution_x": WIDTH, "resolution_y": HEIGHT, "sample_count": 16} | settings)
    render = bpy.context.scene.render
    render.image_settings.media_type, render.image_settings.file_format = "IMAGE", "OPEN_EXR"
    render.image_settings.color_mode, render.image_settings.color_depth = "RGBA", "32"
    render.image_settings.views_format = "INDIVIDUAL"
    render.filepath = str(folder / "view.exr")
    assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
    return [pixels_of(folder / f"view{suffix}.exr") for suffix in suffixes]


def pixels_of(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return np.stack([np.array(channels[name].pixels, np.float32)[::-1] for name in "RGBA"], axis=-1)


def overlap(one, other):
    """Return the shared part of the union of two silhouettes."""
    one, other = (pixels[..., 3] > 0.5 for pixels in (one, other))
    return (one & other).sum() / (one | other).sum()


@pytest.mark.parametrize(
    ("mode", "fit", "pivot"),
    share_of_rows([("OFFAXIS", "HORIZONTAL", "LEFT"), ("OFFAXIS", "VERTICAL", "CENTER"), ("TOE", "AUTO", "RIGHT")], 2),
)
def test_each_eye_sees_what_it_sees_in_cycles(pair, tmp_path, mode, fit, pivot):
    pair.camera.data.stereo.convergence_mode, pair.camera.data.sensor_fit = mode, fit
    pair.camera.data.stereo.pivot, pair.camera.data.shift_x = pivot, 0.1
    ours, theirs = views(tmp_path), views(tmp_path, engine="CYCLES")
    assert overlap(ours[0], ours[1]) < 0.9
    for eye in (0, 1):
        assert overlap(ours[eye], theirs[eye]) > 0.96


def test_a_parallel_projection_has_two_eyes_too(pair, tmp_path):
    pair.camera.data.type, pair.camera.data.ortho_scale = "ORTHO", 4.0
    ours, theirs = views(tmp_path, pixel_aspect_y=1.5), views(tmp_path, pixel_aspect_y=1.5, engine="CYCLES")
    assert all(overlap(ours[eye], theirs[eye]) > 0.92 for eye in (0, 1))


def test_views_of_two_cameras_are_the_pictures_of_each(pair, tmp_path):
    left = pair.camera
    right = bpy.data.objects.new("Camera_R", left.data)
    right.location, right.rotation_euler = (1.0, -5.0, 0.5), left.rotation_euler
    pair.collection.objects.link(right)
    left.name = "Camera_L"
    pair.render.views_format = "MULTIVIEW"
    both = views(tmp_path)
    pair.render.use_multiview = False
    for camera, seen in zip((left, right), both, strict=True):
        pair.camera = camera
        np.testing.assert_allclose(seen, views(tmp_path, ("",))[0], atol=1e-6)


def test_passes_are_those_of_each_view(pair, tmp_path):
    """If both eyes are at one place, both views equal the picture without stereo, including motion vectors."""
    pair.camera.data.stereo.interocular_distance, pair.camera.data.stereo.convergence_mode = 0.0, "PARALLEL"
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_vector = True
    pair.render.use_multiview = False
    mono = rendered(tmp_path)
    pair.render.use_multiview, pair.render.image_settings.views_format = True, "MULTIVIEW"
    bpy.ops.render.render(write_still=True)
    found = {}
    with OpenEXR.File(str(tmp_path / "rendered.exr"), separate_channels=True) as file:
        for part in file.parts:
            channels = {name: np.array(channel.pixels, np.float32)[::-1] for name, channel in part.channels.items()}
            found |= {(part.header["view"], name): pixels for name, pixels in channels.items()}
    for view in ("left", "right"):
        for name, letter, channel in (("Combined", "A", 3), ("Vector", "Z", 2)):
            stereo = found[view, f"{layer.name}.{name}.{letter}"]
            np.testing.assert_allclose(stereo, mono[name][..., channel], atol=1e-5)


def test_blender_writes_both_beside_each_other(pair, tmp_path):
    each = views(tmp_path)
    settings = pair.render.image_settings
    settings.views_format, settings.stereo_3d_format.display_mode = "STEREO_3D", "SIDEBYSIDE"
    pair.render.filepath = str(tmp_path / "both.exr")
    bpy.ops.render.render(write_still=True)
    np.testing.assert_allclose(pixels_of(tmp_path / "both.exr"), np.concatenate(each, axis=1), atol=1e-5)


def test_hair_is_composited_into_each_view(pair, tmp_path):
    """Hair is composited into each view over surfaces by Cycles, with the silhouettes of a render of both by Vellus."""
    ours = views(tmp_path)
    configure(engine="CYCLES")
    composite.turn_on(pair)
    composited = views(tmp_path, engine="CYCLES")
    composite.turn_off(pair)
    assert all(overlap(ours[eye], composited[eye]) > 0.96 for eye in (0, 1))


def test_composited_views_are_those_of_the_scene(pair, tmp_path):
    """Composited views are those of the scene: without a view that is off, and with an artist's view and its camera."""
    bpy.data.objects["Camera"].name = "Camera_L"
    top = bpy.data.objects.new("Camera_top", pair.camera.data)
    top.location = 0.0, 0.0, 6.0
    pair.collection.objects.link(top)
    pair.render.views_format = "MULTIVIEW"
    configure(engine="CYCLES")
    composite.turn_on(pair)
    pair.render.views["right"].use = False
    pair.render.views.new("top").camera_suffix = "_top"
    composite.follow(pair)
    composited = views(tmp_path, ("_L", "_top"), engine="CYCLES")
    composite.turn_off(pair)
    ours = views(tmp_path, ("_L", "_top"))
    assert all(overlap(*both) > 0.96 for both in zip(ours, composited, strict=True))
    assert overlap(*ours) < 0.95
