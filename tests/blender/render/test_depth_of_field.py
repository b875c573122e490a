# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth of field spreads a small bright square by the thin lens formula and as Cycles does."""

import math
from types import SimpleNamespace

import bpy
import gpu
import numpy as np
import pytest

from hair_addon.blender.data.scene import read_camera
from hair_addon.blender.render import drawn_scene, offscreen
from hair_addon.blender.render.viewport import region_pictures, rendered_view, viewport
from hair_addon.blender.render.viewport.view_film import ViewFilm
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from tests.support.pictures.rendering import rendered

DISTANCE, FOCUS = 5.0, 3.0
SAMPLES = 1024
FSTOPS = {"PERSP": 0.05, "ORTHO": 2.0}


@pytest.fixture
def square(scene):
    """Return a white square of 6 cm across the view, before nothing, and a camera that looks at it."""
    bpy.ops.mesh.primitive_plane_add(size=0.06)
    bpy.ops.object.light_add(type="SUN", location=(0.0, 0.0, 3.0))
    bpy.ops.object.camera_add(location=(0.0, 0.0, DISTANCE))
    scene.camera = bpy.context.object
    camera = scene.camera.data
    camera.ortho_scale, camera.dof.focus_distance = 2.0, FOCUS
    return scene.camera


def use_lens(camera, kind):
    camera.data.type, camera.data.dof.aperture_fstop, camera.data.dof.use_dof = kind, FSTOPS[kind], True


def spread(picture):
    """Return the (2, 2) covariance [pixels²] of the light of a picture."""
    light = picture[..., 0].astype(np.float64)
    places = np.stack(np.mgrid[: light.shape[0], : light.shape[1]][::-1], axis=-1).reshape(-1, 2)
    return np.cov(places.T, aweights=light.ravel(), bias=True)


def radius_by_formula(camera, width):
    """Return the radius [pixels] of the square's circle of confusion by the formula."""
    if camera.data.type == "ORTHO":
        return 0.5 / FSTOPS["ORTHO"] * abs(1.0 - DISTANCE / FOCUS) * width / camera.data.ortho_scale
    focal_length = 1e-3 * camera.data.lens
    aperture = 0.5 * focal_length / FSTOPS["PERSP"]
    return aperture * abs(1.0 / DISTANCE - 1.0 / FOCUS) * width * camera.data.lens / camera.data.sensor_width


@pytest.mark.parametrize("kind", FSTOPS)
def test_a_point_off_focus_is_a_circle_of_confusion(square, tmp_path, kind):
    """Out of focus a point is a disk with a variance of a quarter of the squared radius; the square's own is
    subtracted.
    """
    square.data.type = kind
    sharp = spread(rendered(tmp_path, film_transparent=True, sample_count=64)["Combined"])
    use_lens(square, kind)
    blurred = spread(rendered(tmp_path, sample_count=SAMPLES)["Combined"]) - sharp
    radius = radius_by_formula(square, bpy.context.scene.render.resolution_x)
    assert radius > 4.0
    np.testing.assert_allclose(blurred, 0.25 * radius**2 * np.eye(2), atol=0.04 * 0.25 * radius**2)


@pytest.mark.parametrize("kind", FSTOPS)
def test_blades_make_the_figure_of_cycles(square, tmp_path, kind):
    """Three rotated blades and an anamorphic ratio give Cycles' picture and covariance."""
    use_lens(square, kind)
    lens = square.data.dof
    lens.aperture_blades, lens.aperture_rotation, lens.aperture_ratio = 3, 0.4, 1.6
    ours = rendered(tmp_path, film_transparent=True, sample_count=SAMPLES)["Combined"][..., 0]
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.device, scene.cycles.filter_width = SAMPLES, "CPU", 0.01
    scene.cycles.use_denoising = False
    theirs = rendered(tmp_path, engine="CYCLES")["Combined"][..., 0]
    blocks = [picture.reshape(18, 4, 24, 4).sum(axis=(1, 3)) / picture.sum() for picture in (ours, theirs)]
    assert np.abs(blocks[0] - blocks[1]).sum() < 0.12
    np.testing.assert_allclose(
        spread(ours[..., None]), spread(theirs[..., None]), atol=0.03 * np.trace(spread(theirs[..., None]))
    )


def test_an_object_in_focus_is_sharp(square, tmp_path):
    """An object in focus is sharp, also off the view axis, along which its distance is measured."""
    square.location = (1.0, 0.0, DISTANCE)
    square.data.shift_x = -1.0 / DISTANCE * square.data.lens / square.data.sensor_width
    sharp = rendered(tmp_path, film_transparent=True, sample_count=64)["Combined"]
    use_lens(square, "PERSP")
    square.data.dof.focus_object = bpy.data.objects["Plane"]
    focused = rendered(tmp_path, sample_count=64)["Combined"]
    assert sharp[..., 3].sum() > 2.0
    np.testing.assert_allclose(spread(focused), spread(sharp), rtol=0.03, atol=0.02)


def test_hair_blurs_with_the_surface_below_it(lit, tmp_path):
    """Out of focus, hair and surface both lose detail and keep their light; the offscreen picture is the same."""
    bpy.context.view_layer.vellus.has_hair_mask = True
    sharp = rendered(tmp_path, film_transparent=True, sample_count=32)
    lens = bpy.context.scene.camera.data.dof
    lens.use_dof, lens.focus_distance, lens.aperture_fstop = True, 4.0, 0.1
    blurred = rendered(tmp_path, sample_count=64)
    for name in ("Combined", "Hair Mask"):
        before, after = sharp[name], blurred[name]
        assert after.mean() == pytest.approx(before.mean(), rel=0.1), name
        steps = [np.abs(np.diff(picture, axis=0)).mean() for picture in (before, after)]
        assert steps[1] < 0.85 * steps[0], name
    drawn = offscreen.draw_picture(PictureSettings(96, 72, 8, is_transparent=True))
    assert np.abs(drawn - blurred["Combined"]).mean() < 0.02 * math.sqrt(np.square(drawn).mean())


@pytest.mark.parametrize("through_camera", [False, True])
def test_a_rendered_viewport_blurs_only_through_the_camera(lit, tmp_path, monkeypatch, through_camera):
    """A rendered viewport blurs only through the camera, as a render with as many samples does."""
    width, height = 96, 72
    blender_scene, depsgraph = bpy.context.scene, bpy.context.evaluated_depsgraph_get()
    blender_scene.render.film_transparent = True
    lens = blender_scene.camera.data.dof
    lens.focus_distance, lens.aperture_fstop, lens.use_dof = 4.0, 0.1, through_camera
    expected = rendered(tmp_path, sample_count=32)["Combined"]
    lens.use_dof = True
    drawn = drawn_scene.read(blender_scene, bpy.context.view_layer, depsgraph)
    monkeypatch.setattr(viewport, "drawn_scene_of", lambda _context: drawn)
    names = ("view_matrix", "window_matrix")
    matrices = dict(zip(names, read_camera(blender_scene, depsgraph, width, height), strict=True))
    context = SimpleNamespace(
        scene=blender_scene,
        evaluated_depsgraph_get=bpy.context.evaluated_depsgraph_get,
        space_data=SimpleNamespace(use_local_camera=False, use_render_border=False),
        region=SimpleNamespace(width=width, height=height, as_pointer=lambda: 1),
        region_data=SimpleNamespace(view_perspective="CAMERA" if through_camera else "PERSP", **matrices),
    )
    with gpu.types.GPUOffScreen(width, height).bind():
        while rendered_view.draw(context):
            pass
    shown = region_pictures.known_picture(context.region, ViewFilm).picture.read()
    region_pictures.drop_picture(context.region, ViewFilm)
    assert np.abs(shown - expected).mean() < 0.02 * np.sqrt(np.square(expected).mean())
