# SPDX-License-Identifier: GPL-3.0-or-later
"""The offscreen picture: hair is at its position, surfaces hide it, and it absorbs light."""

import math

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.data.pictures import drawn_meshes
from hair_addon.blender.gpu import (
    ambient_visibility,
    drawing,
    hair_shading,
    level_of_detail,
    lights,
    shadows,
    strand_textures,
    visibility_buffer,
)
from hair_addon.blender.gpu.lights import World
from hair_addon.blender.gpu.programs import uniforms
from hair_addon.blender.groom import pipeline
from hair_addon.blender.render import drawn_scene, hair_cache, offscreen, scene_drawing
from hair_addon.blender.settings import preferences
from hair_addon.core.imaging.pixel_sampling import PictureSettings
from hair_addon.core.shading.fibre import kajiya_kay
from hair_addon.core.shading.tables import lookup_tables, strand_tables
from tests.support.pairs import pairs
from tests.support.reading import points


def picture(**settings):
    """Return (H, W, 4) linear pixels, first row at the bottom."""
    settings = {"width": 96, "height": 96, "samples_per_side": 2, "is_transparent": True} | settings
    return offscreen.draw_picture(PictureSettings(**settings))


def thicken(hair):
    """Make strands as thick as a sample, as only a part of the samples shows thinner strands."""
    hair.data.vellus.hair.radius, hair.data.vellus.hair.tip_taper = 0.04, 1.0
    bpy.context.view_layer.update()


def test_hair_is_drawn_where_its_strands_are(lit):
    bpy.data.objects["Sphere"].hide_render = True
    thicken(lit)
    drawn = picture()[..., 3] > 0.0
    depsgraph = bpy.context.evaluated_depsgraph_get()
    world_to_view, view_to_clip = scene.read_camera(bpy.context.scene, depsgraph, 96, 96)
    strands = points(lit).reshape(-1, 3)
    clip = np.c_[strands, np.ones(len(strands))] @ (view_to_clip @ world_to_view).T
    pixels = ((0.5 * clip[:, :2] / clip[:, 3:] + 0.5) * 96).astype(int)
    assert drawn[pixels[:, 1], pixels[:, 0]].mean() > 0.97
    near = np.zeros_like(drawn)
    for dy in (-2, -1, 0, 1, 2):
        for dx in (-2, -1, 0, 1, 2):
            near[np.clip(pixels[:, 1] + dy, 0, 95), np.clip(pixels[:, 0] + dx, 0, 95)] = True
    assert not (drawn & ~near).any()


def test_a_surface_hides_the_hair_behind_it(lit, fine_shadows):
    alone = picture()
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, -4.0, 0.0), rotation=(math.pi / 2, 0.0, 0.0))
    hidden = picture()
    assert (hidden[..., 3] == 1.0).all()
    lit.hide_set(True)
    np.testing.assert_allclose(picture(), hidden, atol=1e-3)
    assert not np.allclose(alone, hidden, atol=1e-3)


def test_no_light_arrives_behind_a_surface(lit):
    """No light of the sun arrives behind a surface that the camera does not see."""
    bright = picture()[..., :3].max()
    bpy.ops.mesh.primitive_plane_add(size=8.0, location=(0.0, -3.6, 2.1), rotation=(math.pi / 3, 0.0, 0.0))
    bpy.context.object.visible_camera = True
    bpy.data.objects["Sphere"].hide_render = True
    camera = bpy.context.scene.camera
    camera.location, camera.rotation_euler = (0.0, 8.0, 0.0), (math.pi / 2, 0.0, math.pi)
    behind = picture()
    hair_pixels = behind[..., 3] > 0.9
    assert bright > 0.05
    assert np.median(behind[hair_pixels][:, :3].max(axis=1)) < 0.05 * bright


def test_the_picture_is_the_same_twice(lit):
    assert np.array_equal(picture(), picture())


def test_supersampling_keeps_the_mean(lit):
    one, many = picture(samples_per_side=1), picture(samples_per_side=6)
    assert one.mean() == pytest.approx(many.mean(), rel=0.05)
    assert picture(samples_per_side=4).mean() == pytest.approx(many.mean(), rel=0.02)


def test_a_viewport_without_hair_reads_nothing(sphere, monkeypatch):
    """An enabled add-on does not read scenes without hair."""

    def forbidden(*_args, **_kwargs):
        raise AssertionError("the scene was read")

    for door, name in ((drawn_meshes, "read_drawn_meshes"), (lights, "read_lights")):
        monkeypatch.setattr(door, name, forbidden)
    context = bpy.context
    viewport = next(a.spaces.active for s in bpy.data.screens for a in s.areas if a.type == "VIEW_3D")
    drawn = drawn_scene.read(context.scene, context.view_layer, context.evaluated_depsgraph_get(), viewport)
    assert drawn.hair == [] and drawn.surfaces == [] and drawn.shadow_maps is None


def test_more_samples_than_the_driver_supports_are_refused(lit):
    with pytest.raises(pipeline.HairError, match="use fewer"):
        picture(width=16384, height=16384, samples_per_side=8)


def curtain(distance, count=400, width=1.0, radius=0.001):
    """Return `count` vertical strands side by side over `width` meters, at a distance along +Y: (S, 3, 3) points,
    radii.
    """
    x = (np.arange(count) + 0.5) / count * width - 0.5 * width
    z = np.linspace(-0.5 * width, 0.5 * width, 3)
    strands = np.stack(np.broadcast_arrays(x[:, None], distance, z[None, :]), axis=-1).astype(np.float32)
    return strands, np.full(strands.shape[:2], radius, np.float32)


@pytest.mark.parametrize("sheets", [0, 1, 3])
def test_light_through_curtains_falls_exponentially(scene, sheets):
    """Light behind curtains falls as exp(-n (1 - a)), where each curtain covers n = count × 2 radius / width on
    average.
    """
    coverage = 400 * 0.002 / 1.0
    settings = kajiya_kay.Settings(specular_color=(0.0, 0.0, 0.0), diffuse_color=(0.8, 0.4, 0.1))
    shading = hair_shading.kajiya_kay_shading(settings)
    lights = uniforms.LIGHTS.record()
    lights["count"] = 1
    lights["light"][0]["kind"] = 0
    lights["light"][0]["axis"][:3] = (0.0, 1.0, 0.0)
    lights["light"][0]["power"][:3] = np.pi**2
    hair = [strand_textures.upload_strands(*curtain(0.1 + 0.1 * i)) for i in range(sheets)]
    # Too thin to count among its own curtains: a strand lies in a layer that it darkens too.
    receiver = strand_textures.upload_strands(*curtain(0.6, radius=0.00002))
    lights["light"][0]["casts_shadow"] = True
    maps = shadows.ShadowMaps(512, 1)
    placed = [(strands, np.eye(4)) for strands in (*hair, receiver)]
    maps.draw(lights, placed, [])
    seen, _none = ambient_visibility.measure([(receiver, np.eye(4))], [], [shading.opacity], [])
    drawn = [(receiver, shading, np.eye(4), level_of_detail.NO_LIMITS)]
    radiance = seen_from_behind(drawn_scene.DrawnScene(drawn, [], lights, World(np.zeros(3)), maps, seen, []))
    depth = -np.log(radiance / np.array(settings.diffuse_color))
    expected = sheets * coverage * (1.0 - 0.5 * np.array(settings.diffuse_color))
    np.testing.assert_allclose(depth, expected, rtol=0.06, atol=0.01)


def seen_from_behind(drawn):
    """Return the mean radiance of a curtain's middle, seen against the light's direction."""

    world_to_view = np.array([[-1, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, -2.0], [0, 0, 0, 1.0]])
    view_to_clip = np.array([[4.0, 0, 0, 0], [0, 4.0, 0, 0], [0, 0, -0.2, 0], [0, 0, 0, 1.0]])
    view = drawing.view_record(world_to_view, view_to_clip, 64, least_width=1.0)
    buffer = visibility_buffer.VisibilityBuffer(64, 64)
    with buffer.surfaces():
        pass
    scene_drawing.draw_hair(drawn, view, buffer)
    pixels = np.array(buffer.color.read(), np.float32).reshape(-1, 4)
    return pixels[pixels[:, 3] > 0.0][:, :3].mean(axis=0)


def test_each_look_is_drawn_from_tables_of_its_own_baked_where_the_user_wants(lit, monkeypatch):
    """Each look is drawn from its own tables, baked on the chosen device; varied hair uses slices of tables."""
    baked = []
    for module in (lookup_tables, strand_tables):
        real = module.bake
        monkeypatch.setattr(
            module,
            "bake",
            lambda *args, real=real, module=module: (baked.append((module, args[-1])), real(*args[:-1]))[1],
        )
    monkeypatch.setattr(preferences, "device", lambda: "cuda:3")
    look = lit.data.vellus.appearance
    hair_cache.shading_of(lit.data)
    look.random_color = 0.3
    hair_cache.shading_of(lit.data)
    hair_cache.shading_of(lit.data)  # kept
    assert baked == [(lookup_tables, "cuda:3"), (strand_tables, "cuda:3")]


@pytest.mark.parametrize(("model", "mode"), pairs(["KAJIYA_KAY", "MARSCHNER"], ["energy", "classic"], 2))
def test_dyed_tips_are_drawn_in_their_colour(lit, model, mode):
    """A red dye at the tips reddens the tips and nothing else, under light from everywhere and from the sun."""
    thicken(lit)
    state = lit.data.vellus
    state.model, state.appearance.mode = model, mode
    state.appearance.parametrization, state.appearance.absorption = "ABSORPTION", (0.05, 0.05, 0.05)
    bpy.data.objects["Sphere"].hide_render = True
    even = picture()
    state.appearance.tip_tint = (1.0, 0.1, 0.1)
    state.appearance.gradient_start, state.appearance.gradient_end = 0.6, 0.7
    dyed = picture()
    covered = even[..., 3] > 0.9
    y, x = np.mgrid[:96, :96] - 47.5
    distance = np.hypot(x, y)
    tips = covered & (distance > np.percentile(distance[covered], 90))
    redness = [p[..., 0].astype(float) / np.maximum(p[..., 1], 1e-6) for p in (even, dyed)]
    assert np.median(redness[1][tips]) > 1.2 * np.median(redness[0][tips])
    assert np.isfinite(dyed).all()


@pytest.mark.parametrize("model", ["KAJIYA_KAY", "MARSCHNER"])
def test_a_strand_has_the_colour_of_its_random_number(lit, model):
    """Strands with random numbers of little pigment, on the left, are brighter than those of much pigment, on the
    right.
    """
    state = lit.data.vellus
    state.model, state.appearance.melanin = model, 0.6
    bpy.data.objects["Sphere"].hide_render = True
    numbers = (points(lit)[:, 0, 0] > 0.0).astype(np.float32)
    lit.data.attributes["strand_random"].data.foreach_set("value", numbers)
    lit.data.update_tag()
    bpy.context.view_layer.update()
    ratios = []
    for amount in (0.0, 1.0):
        state.appearance.random_color = amount
        color = picture()[..., :3]
        ratios.append(color[:, :40].mean() / color[:, -40:].mean())
    assert 0.7 < ratios[0] < 1.4  # other strands stand on the left than on the right
    assert ratios[1] > 2.0 * ratios[0]


def test_an_elliptic_section_is_the_classic_mode_s_alone(lit):
    state = lit.data.vellus
    state.marschner.size, state.marschner.eccentricity = 32, 0.85
    drawn = {}
    for mode in ("energy", "classic"):
        state.appearance.mode = mode
        drawn[mode] = "n_trt_slices" in hair_cache.shading_of(lit.data).samplers
    assert drawn == {"energy": False, "classic": True}
    assert np.isfinite(picture(width=48, height=48)).all()
    state.marschner.eccentricity = 1.0
    assert "n_trt_table" in hair_cache.shading_of(lit.data).samplers


@pytest.mark.parametrize("kind", ["VIDEO", "MULTI_LAYER_IMAGE"])
def test_output_settings_of_a_scene_are_restored(lit, tmp_path, kind):
    image = bpy.context.scene.render.image_settings
    image.media_type = kind
    before = image.media_type, image.file_format, image.color_mode
    offscreen.write_picture(np.ones((3, 4, 4), np.float32), tmp_path / "a.png", bpy.context.scene)
    assert (tmp_path / "a.png").exists()
    assert (image.media_type, image.file_format, image.color_mode) == before
