# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine's picture equals the offscreen picture, at any size, in tiles and over any backdrop."""

import math
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from hair_addon.blender.gpu import drawing
from hair_addon.blender.render import film, offscreen
from hair_addon.core.errors import HairError
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support.commands import PYTHONPATH
from tests.support.pairs import share_of
from tests.support.pictures.rendering import configure, layers_of, light_up, read_layers, rendered

ROOT = Path(__file__).resolve().parents[4]


def offscreen_picture(width=96, height=72, samples_per_side=2):
    return offscreen.draw_picture(PictureSettings(width, height, samples_per_side, is_transparent=True))


@pytest.mark.parametrize(("kind", "filter_size"), [("PERSP", 0.0), ("ORTHO", 1.5)])
def test_it_renders_the_offscreen_picture(lit, tmp_path, kind, filter_size):
    light_up()
    camera = bpy.context.scene.camera.data
    camera.type, camera.ortho_scale, camera.shift_x, camera.shift_y = kind, 4.0, 0.1, -0.05
    combined = rendered(tmp_path, film_transparent=True, pixel_aspect_x=1.5, filter_size=filter_size)["Combined"]
    np.testing.assert_allclose(combined, offscreen_picture(), atol=1e-6)
    assert (combined[..., 3] > 0.5).mean() > 0.05


def test_more_samples_come_closer_to_many(lit, tmp_path):
    """For any number of samples, the errors of color and alpha fall at least as fast as those of random samples."""
    many = rendered(tmp_path, film_transparent=True, sample_count=200)["Combined"]
    errors = [
        np.sqrt(np.mean((rendered(tmp_path, sample_count=count)["Combined"] - many) ** 2, axis=(0, 1)))
        for count in (2, 9, 36)
    ]
    assert (errors[1] < 0.6 * errors[0]).all()
    assert (errors[2] < 0.6 * errors[1]).all()


@pytest.mark.parametrize("filter_size", [0.0, 1.5])
def test_tiles_join_without_a_seam(lit, tmp_path, monkeypatch, filter_size):
    bpy.context.view_layer.use_pass_z = True
    bpy.context.view_layer.vellus.has_hair_mask = True
    whole = rendered(tmp_path, film_transparent=True, sample_count=8, filter_size=filter_size)
    monkeypatch.setattr(film, "largest_tile", lambda *_settings: 37)
    for name, tiled in rendered(tmp_path, sample_count=8, filter_size=filter_size).items():
        # A rounding error moves a sample across an edge here and there.
        differs = np.abs(tiled - whole[name]) > 1e-4 * np.maximum(np.abs(whole[name]), 1.0)
        assert differs.mean() < 0.003, name
        assert differs[:, 34:40].mean() < 0.01 and differs[34:40].mean() < 0.01, name
        mean = [np.mean(pixels[pixels < 1e9]) for pixels in (tiled, whole[name])]
        assert mean[0] == pytest.approx(mean[1], rel=1e-3)


def test_a_picture_larger_than_any_texture_is_rendered(lit, tmp_path, monkeypatch):
    largest = 64
    monkeypatch.setattr(film, "_MOST_SAMPLES", largest)
    made = []
    real = film.VisibilityBuffer
    monkeypatch.setattr(
        film, "VisibilityBuffer", lambda *size, **options: (made.append(size), real(*size, **options))[1]
    )
    combined = rendered(tmp_path, film_transparent=True, sample_count=4)["Combined"]
    assert made and max(map(max, made)) <= largest
    np.testing.assert_allclose(combined.mean(), offscreen_picture().mean(), rtol=1e-3)


def test_a_border_between_pixels_is_rounded_as_blender_does(lit, tmp_path):
    """A border between pixels is rounded in single precision as by Blender: 430 of 760 parts of 3040 pixels are
    1720, not 1719.
    """
    part = rendered(
        tmp_path,
        resolution_x=3040,
        resolution_y=4,
        sample_count=1,
        use_border=True,
        use_crop_to_border=True,
        border_min_x=430 / 760,
        border_max_x=580 / 760,
    )["Combined"]
    assert part.shape[1] == 600


@pytest.mark.parametrize("is_cropped", share_of([False, True], 2))
def test_a_border_is_rendered_as_in_the_whole_picture(lit, fine_shadows, tmp_path, is_cropped):
    whole = rendered(tmp_path, film_transparent=True)["Combined"]
    border = {"border_min_x": 0.3, "border_max_x": 0.71, "border_min_y": 0.2, "border_max_y": 0.66}
    part = rendered(tmp_path, use_border=True, use_crop_to_border=is_cropped, **border)["Combined"]
    rows, columns = slice(14, 47), slice(28, 68)
    if not is_cropped:
        outside = np.ones(part.shape[:2], bool)
        outside[rows, columns] = False
        assert (part[outside] == 0.0).all()
        part = part[rows, columns]
    assert part.shape == (33, 40, 4)
    differs = np.abs(part - whole[rows, columns]).max(axis=-1) > 3e-4
    assert differs.mean() < 0.005


@pytest.mark.parametrize("filter_size", [0.0, 1.5])
@pytest.mark.parametrize("light", [0.0, 1.0])
def test_over_black_and_over_white_it_is_what_is_rendered_there(lit, tmp_path, light, filter_size):
    """Over black and over white, the picture equals the one rendered there within 1/255, also at edges of hair."""
    light_up((light,) * 3)
    settings = {"sample_count": 16, "filter_size": filter_size}
    empty = rendered(tmp_path, film_transparent=True, **settings)["Combined"]
    filled = rendered(tmp_path, film_transparent=False, **settings)["Combined"]
    partly = (empty[..., 3] > 0.05) & (empty[..., 3] < 0.95)
    assert partly.sum() > 200
    np.testing.assert_allclose(empty[..., :3] + (1.0 - empty[..., 3:]) * light, filled[..., :3], atol=1e-4)
    np.testing.assert_allclose(filled[..., 3], 1.0, atol=1e-5)


def test_a_png_composites_as_the_exr_does(lit, tmp_path):
    """A straight PNG of 8 bits composites over black and white within 1/255 of the picture that it was written from."""
    scene = bpy.context.scene
    light_up()
    exr = rendered(tmp_path, film_transparent=True, sample_count=16)["Combined"]
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format, scene.render.image_settings.color_mode = "PNG", "RGBA"
    scene.render.dither_intensity = 0.0
    scene.render.filepath = str(tmp_path / "straight.png")
    bpy.ops.render.render(write_still=True)
    straight = pixels_of(tmp_path / "straight.png")
    color = exr[..., :3] / np.maximum(exr[..., 3:], 1e-6)
    for backdrop in (0.0, 1.0):
        over = straight[..., :3] * straight[..., 3:] + (1.0 - straight[..., 3:]) * backdrop
        wanted = np.clip(color, 0.0, 1.0) * exr[..., 3:] + (1.0 - exr[..., 3:]) * backdrop
        np.testing.assert_allclose(over, wanted, atol=1.0 / 255.0 + 1e-5)


def pixels_of(path):
    """Return (height, width, 4) stored values of a picture file."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name, image.alpha_mode = "Non-Color", "CHANNEL_PACKED"
    pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    width, height = image.size
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def test_motion_blur_is_the_mean_of_still_pictures(lit, tmp_path, monkeypatch):
    """Motion blur is the mean of still pictures with the same samples, for moving hair, surface and camera."""
    real = drawing.pass_record
    monkeypatch.setattr(drawing, "pass_record", lambda *args: real(*args[:3], 0, *args[4:]))
    scene = bpy.context.scene
    for thing, path, end in (
        (bpy.data.objects["Sphere"], "location", (0.8, 0.0, 0.3)),
        (scene.camera, "location", None),
    ):
        thing.keyframe_insert(path, frame=1)
        thing.location = end or (0.3, -7.5, 0.2)
        thing.keyframe_insert(path, frame=3)
    scene.frame_set(2)
    blur = {"use_motion_blur": True, "motion_blur_shutter": 0.8, "motion_steps": 4, "sample_count": 64}
    blurred = rendered(tmp_path, film_transparent=True, **blur)["Combined"]
    assert (scene.frame_current, scene.frame_subframe) == (2, 0.0)
    stills = []
    for moment in (-0.3, -0.1, 0.1, 0.3):
        scene.frame_set(math.floor(2 + moment), subframe=moment % 1.0)
        stills.append(rendered(tmp_path, use_motion_blur=False, sample_count=16)["Combined"])
    np.testing.assert_allclose(blurred, np.mean(stills, axis=0), atol=1e-5)
    assert np.abs(blurred - stills[1]).mean() > 5e-3


def test_view_layers_are_rendered_apart(lit, tmp_path):
    scene = bpy.context.scene
    other = scene.view_layers.new("Without hair")
    alone = bpy.data.collections.new("Hair alone")
    scene.collection.children.link(alone)
    alone.objects.link(lit)
    scene.collection.objects.unlink(lit)
    other.layer_collection.children["Hair alone"].exclude = True
    other.vellus.has_hair_mask = True
    layers = layers_of(tmp_path, film_transparent=True)
    assert set(layers) == {"ViewLayer", "Without hair"}
    assert "Hair Mask" not in layers["ViewLayer"]
    assert (layers["Without hair"]["Hair Mask"] == 0.0).all()
    assert layers["Without hair"]["Combined"][..., 3].sum() < layers["ViewLayer"]["Combined"][..., 3].sum()


def test_each_frame_follows_the_deformed_surface(arm, tmp_path):
    scene = bpy.context.scene
    bpy.context.view_layer.objects.active = arm
    bpy.ops.vellus.add_hair(guide_count=60, strand_count=600, length=0.3, radius=0.01)
    bpy.ops.object.camera_add(location=(0.0, 0.0, 9.0))
    scene.camera = bpy.context.object
    bpy.ops.object.light_add(type="SUN")
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 11, 10
    configure(film_transparent=True)
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.filepath = str(tmp_path / "frame_")
    scene.frame_set(1)
    bpy.ops.render.render(animation=True)
    pictures = {frame: read_layers(tmp_path / f"frame_{frame:04}.exr")["ViewLayer"]["Combined"] for frame in (1, 11)}
    for frame, pixels in pictures.items():
        scene.frame_set(frame)
        assert np.abs(pixels - offscreen_picture()).mean() < 2e-3
    assert np.abs(pictures[1] - pictures[11]).mean() > 0.02


def test_unsupported_renders_are_reported_in_one_sentence(lit, tmp_path):
    configure(filepath=str(tmp_path / "nothing.png"))
    camera = bpy.context.scene.camera.data
    camera.type = "CUSTOM"
    with pytest.raises(RuntimeError, match="perspective, orthographic and panoramic"):
        bpy.ops.render.render(write_still=True)
    camera.type, bpy.context.view_layer.use_pass_vector = "PANO", True
    with pytest.raises(RuntimeError, match="turn off the pass Vector"):
        bpy.ops.render.render(write_still=True)
    bpy.context.view_layer.use_pass_vector = False
    bpy.context.scene.render.use_multiview = camera.stereo.use_spherical_stereo = True
    with pytest.raises(RuntimeError, match="turn off Spherical Stereo"):
        bpy.ops.render.render(write_still=True)
    with pytest.raises(HairError, match="render a frame instead"):
        offscreen_picture()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("error", "reported"),
    [
        (ZeroDivisionError, "could not render this: A sentence"),
        (KeyboardInterrupt, "Canceled: nothing was rendered"),
        (HairError, "A sentence"),
    ],
)
def test_an_interrupted_render_writes_no_picture(lit, tmp_path, monkeypatch, error, reported):
    """A render ended by a bug, Ctrl-C or `HairError` writes no picture, reports a message and starts no further
    frame.
    """
    calls = []

    def broken(*_args):
        calls.append(1)
        raise error("A sentence.")  # a new one: its traceback holds on to what is on the GPU

    monkeypatch.setattr(film.Film, "add_pass", broken)
    configure(filepath=str(tmp_path / "nothing.png"))
    with pytest.raises(RuntimeError, match=reported):
        bpy.ops.render.render(write_still=True)
    with pytest.raises(RuntimeError, match=reported):
        bpy.ops.render.render(animation=True)
    assert not list(tmp_path.iterdir())
    assert len(calls) == 2


def test_blender_s_panels_are_shown_for_it_while_it_is_there(scene):
    import hair_addon

    names = (
        "RENDER_PT_output",
        "RENDER_PT_format",
        "RENDER_PT_stamp",
        "RENDER_PT_color_management",
        "VIEWLAYER_PT_layer",
    )
    panels = [getattr(bpy.types, name) for name in (*names, "DATA_PT_EEVEE_light", "EEVEE_WORLD_PT_surface")]
    assert all("VELLUS" in panel.COMPAT_ENGINES for panel in panels)
    others = bpy.types.RENDER_PT_eevee_raytracing, bpy.types.DATA_PT_light, bpy.types.RENDER_PT_stereoscopy
    assert not any("VELLUS" in panel.COMPAT_ENGINES for panel in others)
    hair_addon.unregister()
    try:
        assert not any("VELLUS" in panel.COMPAT_ENGINES for panel in panels)
        with pytest.raises(TypeError):
            scene.render.engine = "VELLUS"
    finally:
        hair_addon.register()


def test_a_scene_without_anything_is_its_background(scene, tmp_path):
    """A scene without hair, surfaces and lights shows the world's color, or nothing if transparent."""
    bpy.ops.object.camera_add()
    scene.camera = bpy.context.object
    light_up((0.25, 0.5, 0.75))
    view_layer = bpy.context.view_layer
    view_layer.use_pass_shadow = view_layer.use_pass_vector = view_layer.vellus.has_lobes = True
    passes = rendered(tmp_path)
    assert (passes["Combined"] == (0.25, 0.5, 0.75, 1.0)).all()
    assert all((pixels == 0.0).all() for name, pixels in passes.items() if name != "Combined")
    assert (rendered(tmp_path, film_transparent=True)["Combined"] == 0.0).all()


def test_objects_disabled_in_renders_are_skipped(lit, tmp_path):
    """Objects disabled in renders are skipped, and guides always, as in Cycles and EEVEE."""
    bpy.context.view_layer.vellus.has_hair_mask = True
    bpy.data.objects["Sphere"].hide_render = True
    seen = rendered(tmp_path, film_transparent=True)
    np.testing.assert_array_equal(seen["Hair Mask"], seen["Combined"][..., 3])
    bpy.data.objects["Guides"].hide_render = True
    np.testing.assert_array_equal(rendered(tmp_path)["Hair Mask"], seen["Hair Mask"])
    lit.hide_render = True
    assert (rendered(tmp_path)["Combined"] == 0.0).all()


def test_hair_that_is_instanced_is_rendered_at_each_place(lit, tmp_path):
    bpy.context.view_layer.vellus.has_hair_mask = True
    bpy.data.objects["Sphere"].hide_render = True
    alone = rendered(tmp_path, film_transparent=True)["Hair Mask"]
    collection = bpy.data.collections.new("Tuft")
    collection.objects.link(lit)
    bpy.ops.object.collection_instance_add(collection="Tuft", location=(0.0, 0.0, 1.5))
    twice = rendered(tmp_path)["Hair Mask"]
    assert 1.3 * alone.sum() < twice.sum() < 2.1 * alone.sum()
    assert twice[-20:].sum() > 2.0 * alone[-20:].sum()


def test_hair_s_own_modifiers_are_rendered(lit, tmp_path):
    """Strands that the hair's own modifiers shorten are rendered short, as by Cycles."""
    bpy.context.view_layer.vellus.has_hair_mask = True
    before = rendered(tmp_path, film_transparent=True)["Hair Mask"]
    tree = bpy.data.node_groups.new("Short", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    first, trim, last = map(tree.nodes.new, ("NodeGroupInput", "GeometryNodeTrimCurve", "NodeGroupOutput"))
    trim.inputs["End"].default_value = 0.3
    tree.links.new(first.outputs[0], trim.inputs["Curve"])
    tree.links.new(trim.outputs["Curve"], last.inputs[0])
    lit.modifiers.new("Short", "NODES").node_group = tree
    assert rendered(tmp_path)["Hair Mask"].sum() < 0.6 * before.sum()


@pytest.mark.parametrize("sample_count", [64, 61])
def test_an_edge_is_as_soft_as_the_filter_is_wide(scene, tmp_path, sample_count):
    """The coverage of pixels beside a straight edge is the part of the filter that lies over it, as in Cycles."""
    bpy.ops.object.camera_add(location=(0.0, 0.0, 5.0))
    scene.camera = bpy.context.object
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 96.0  # a unit a pixel
    bpy.ops.mesh.primitive_plane_add(size=200.0, location=(100.3, 0.0, 0.0))
    settings = {"film_transparent": True, "sample_count": sample_count, "filter_size": 1.5}
    alpha = rendered(tmp_path, **settings)["Combined"][..., 3]
    fine = np.linspace(-1.5, 1.5, 3001)
    window = 0.35875 + sum(
        part * np.cos(order * np.pi * fine / 1.5) for part, order in ((0.48829, 1), (0.14128, 2), (0.01168, 3))
    )
    edges = 48.0 + 0.3 - (np.arange(96) + 0.5)  # from the middle of each pixel to the edge
    expected = [window[fine > edge].sum() / window.sum() for edge in edges]
    np.testing.assert_allclose(alpha, np.broadcast_to(expected, alpha.shape), atol=0.05)
    assert 2 <= ((alpha[0] > 0.01) & (alpha[0] < 0.99)).sum() <= 4
    if sample_count == 64:
        cycles = scene.cycles
        cycles.samples, cycles.device, cycles.max_bounces, cycles.filter_width = 64, "CPU", 0, 1.5
        theirs = rendered(tmp_path, engine="CYCLES")["Combined"][..., 3]
        np.testing.assert_allclose(theirs.mean(axis=0), expected, atol=0.02)


@pytest.mark.farm
def test_a_script_that_renders_exits_normally():
    """A script that renders exits normally, because programs and textures are freed before Blender's graphics; its
    first function of `api` registers the add-on.
    """
    script = (
        "import bpy\n"
        "from hair_addon import api\n"
        "settings = api.GroomSettings(api.GuideSettings(guide_count=5), api.HairSettings(strand_count=20))\n"
        "api.add_hair(bpy.context.object, settings)\n"
        "render = bpy.context.scene.render\n"
        "render.engine, render.resolution_x, render.resolution_y = 'VELLUS', 16, 16\n"
        "assert bpy.ops.render.render() == {'FINISHED'}\n"
    )
    line, environment = [sys.executable, "-c", script], os.environ | {"PYTHONPATH": PYTHONPATH}
    done = subprocess.run(line, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr[-2000:]
