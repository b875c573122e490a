# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair in viewports has the scene's color management, thin strands keep their brightness, and no work is
unnecessary.
"""

import re
import shutil
import sys
from dataclasses import replace
from types import SimpleNamespace

import bpy
import gpu
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from hair_addon.blender.data import scene
from hair_addon.blender.data.pictures import drawn_meshes
from hair_addon.blender.data.strands import curves_objects
from hair_addon.blender.gpu import display_transform
from hair_addon.blender.gpu.programs import scene_programs, shaders
from hair_addon.blender.host import notices
from hair_addon.blender.host.caches import Cache
from hair_addon.blender.live import invalidation
from hair_addon.blender.render import drawn_scene, scene_drawing
from hair_addon.blender.render.viewport import hair_picture, region_pictures, viewport
from hair_addon.core.errors import HairError
from tests.support.pictures import glsl
from tests.support.pictures.rendering import rendered

SIZE = 96

# ------------------------------------------------------------------------------------------------- the display


@pytest.fixture
def colors(rng):
    """Return (20000, 3) scene-linear float32, from deep shadow to glints and from gray to saturated."""
    return (2.0 ** rng.uniform(-9.0, 5.0, (20_000, 1)) * rng.random((20_000, 3)) ** 2).astype(np.float32)


SETTINGS = [
    ("AgX", "None", 1.0),
    ("AgX", "AgX - Punchy", 1.0),
    ("Filmic", "High Contrast", 1.3),
    ("Standard", "None", 0.8),
    ("Raw", "None", 1.0),
    ("Khronos PBR Neutral", "None", 1.0),
]


def set_view(blender_scene, view, look, gamma):
    settings = blender_scene.view_settings
    settings.view_transform, settings.look, settings.gamma = view, look, gamma
    return display_transform.DisplayTransform.of(blender_scene)


@pytest.mark.parametrize("settings", SETTINGS)
def test_colours_are_those_that_blender_writes_into_a_picture(blender_scene, colors, tmp_path, settings):
    transform = set_view(blender_scene, *settings)
    image = bpy.data.images.new("colours", 200, 100, float_buffer=True)
    image.pixels.foreach_set(np.concatenate([colors, np.ones((len(colors), 1), np.float32)], axis=1).ravel())
    output = blender_scene.render.image_settings
    output.file_format, output.color_mode, output.color_depth = "PNG", "RGB", "16"
    blender_scene.render.dither_intensity = 0.0
    image.save_render(str(tmp_path / "colours.png"), scene=blender_scene)
    written = bpy.data.images.load(str(tmp_path / "colours.png"))
    written.colorspace_settings.name = "Non-Color"
    blenders = np.empty(4 * len(colors), np.float32)
    written.pixels.foreach_get(blenders)
    ours = np.clip(display_transform.apply(transform, colors), 0.0, 1.0)
    np.testing.assert_allclose(ours, blenders.reshape(-1, 4)[:, :3], atol=2e-4)


@pytest.mark.parametrize("settings", SETTINGS)
def test_the_table_is_as_good_as_eight_bits(blender_scene, colors, settings):
    transform = set_view(blender_scene, *settings)
    at = display_transform.display_place(colors)[:, ::-1].T * (display_transform.SIZE - 1)
    found = np.stack([map_coordinates(transform.table()[..., c], at, order=1) for c in range(3)], axis=-1)
    error = 255.0 * np.abs(found - np.clip(display_transform.apply(transform, colors), 0.0, 1.0))
    assert error.mean() < 0.25
    assert np.quantile(error, 0.99) < 4.0


def test_places_in_the_table_are_twins_and_come_back():
    light = np.concatenate([[0.0, 512.0, 1e6], np.geomspace(1e-6, 500.0, 1000)]).astype(np.float32)
    text = glsl.source("picture/display_transform.glsl")
    shader = glsl.evaluate(text, "vec3", "display_place(vec3(light))", light=light)[:, 1]
    python = display_transform.display_place(light.astype(np.float64))
    np.testing.assert_allclose(shader, python, atol=1e-5)
    np.testing.assert_allclose(display_transform.linear_at(python), np.minimum(light, 512.0), rtol=1e-9, atol=1e-12)


def test_without_opencolorio_colours_are_the_standard_view(blender_scene, colors, monkeypatch, capsys):
    standard = display_transform.apply(set_view(blender_scene, "Standard", "None", 1.0), colors)
    monkeypatch.setitem(sys.modules, "PyOpenColorIO", None)
    without = display_transform.apply(set_view(blender_scene, "AgX", "None", 1.0), colors)
    np.testing.assert_allclose(without, np.clip(standard, 0.0, 1.0), atol=1e-3)
    assert "PyOpenColorIO" in capsys.readouterr().err


def test_hair_is_laid_over_a_viewport_in_its_colours(lit):
    """Hair over white shows the mix of white and the light's display color, to the power that Blender undoes."""
    picture = pictured(lit, 2, per_side=2)
    transform = display_transform.DisplayTransform.of(bpy.context.scene)
    table = hair_picture.table_texture(transform.table())
    below = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    framebuffer = gpu.types.GPUFrameBuffer(color_slots=below)
    with framebuffer.bind():
        framebuffer.clear(color=(1.0, 1.0, 1.0, 1.0))
        picture.show(table, exposure=2.0, opacity=0.5, depth_test="NONE")
        shown = np.array(framebuffer.read_color(0, 0, SIZE, SIZE, 4, 0, "FLOAT"))[..., :3]
    light = picture.read()
    alpha = light[..., 3:]
    straight = (2.0 * light[..., :3] / np.maximum(alpha, 1e-9)).reshape(-1, 3).astype(np.float32)
    display = np.clip(display_transform.apply(transform, straight), 0.0, 1.0).reshape(SIZE, SIZE, 3)
    assert (alpha > 0.1).sum() > 500
    np.testing.assert_allclose(shown, 1.0 - 0.5 * alpha + 0.5 * alpha * display**2.2, atol=0.02)


# ------------------------------------------------------------------------------------------------- thin strands


def sample_offsets(columns, middles, turn):
    """Return the offsets of samples beside axes of strands; arguments of one shape, except the pass."""
    columns, middles = np.broadcast_arrays(columns, middles)
    text = glsl.source("visibility/coverage.glsl")
    x, y = columns.ravel().astype(np.int32), middles.ravel()
    found = glsl.evaluate(text, "float", f"sample_offset(x, y, offset_turn({turn:.4f}))", x=x, y=y)
    return found.reshape(columns.shape)


@pytest.mark.parametrize("width", [0.03, 0.25, 0.7])
def test_samples_hit_just_the_part_that_a_thin_strand_covers(width):
    """Samples hit the part that a thin strand covers, at any slope, and with sixteen samples about as evenly as by
    chance.
    """
    columns, squares = np.arange(48), []
    for slope in (-1.0, -0.6, -0.25, 0.0, 0.15, 0.31, 0.75, 1.0):
        lines = 32.0 + slope * (columns - 23.5) + np.arange(-7.0, 7.0, 0.37)[:, None]
        centers = lines - sample_offsets(columns, lines, 0.3)
        hits = np.floor(centers + 0.5 * width + 0.5) - np.floor(centers - 0.5 * width + 0.5)
        assert hits.mean() == pytest.approx(width, rel=0.1, abs=0.015)
        squares.append(((hits.reshape(-1, 16).sum(axis=1) - 16.0 * width) ** 2).mean())
    assert np.mean(squares) < 1.4 * 16.0 * width * (1.0 - width)


def test_samples_lie_anywhere_in_their_squares():
    columns, middles = np.indices((512, 512))
    offsets, part = sample_offsets(columns, middles + 0.5, 0.25), 1.0 / 16.0
    np.testing.assert_allclose(np.histogram(offsets, 16, (-0.5, 0.5))[0] / offsets.size, part, atol=0.05 * part)


def pictured(hair, passes, per_side, size=SIZE):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
    picture = hair_picture.HairPicture((size, size), per_side)
    matrices = scene.read_camera(bpy.context.scene, depsgraph, size, size)
    for _ in range(passes):
        picture.add_pass(drawn, *matrices)
    return picture


def sparkles(light):
    """Return how many pixels are 1.5 times as bright as the brightest of their eight neighbors."""
    luminance = light[..., :3] @ np.array([0.2126, 0.7152, 0.0722])
    around = [np.roll(luminance, (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1) if x or y]
    return np.count_nonzero((luminance > 1.5 * np.max(around, axis=0)) & (luminance > 0.1 * luminance.max()))


def test_thin_hair_keeps_its_brightness_and_does_not_sparkle(thin):
    """Thin hair has the brightness of many samples in the first pass and later, and does not sparkle."""
    size = 2 * SIZE
    reference = pictured(thin, 16, 2, size).read()
    for per_side in (1, 2):
        fine = hair_picture.SAMPLE_COUNT // per_side**2
        first, last = (pictured(thin, passes, per_side, size).read() for passes in (1, fine))
        for light in (first, last):
            np.testing.assert_allclose(light.mean(axis=(0, 1)), reference.mean(axis=(0, 1)), rtol=0.04)
        assert sparkles(last) <= sparkles(reference) + 0.002 * size**2


def test_surfaces_hide_hair_in_every_sample(lit):
    """Surfaces hide hair in every sample: the half of the strands behind the sphere shows only in X-ray views."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
    bare = replace(drawn, surfaces=[], surface_owners=())
    matrices = scene.read_camera(bpy.context.scene, depsgraph, SIZE, SIZE)
    pictures = {}
    for name, of, through in (("hidden", drawn, False), ("through", drawn, True), ("bare", bare, False)):
        picture = hair_picture.HairPicture((SIZE, SIZE))
        picture.add_pass(of, *matrices, is_see_through=through)
        pictures[name] = picture.read()
    np.testing.assert_array_equal(pictures["through"], pictures["bare"])
    assert pictures["hidden"][..., 3].sum() < 0.9 * pictures["bare"][..., 3].sum()


def test_a_viewport_s_surfaces_are_darkened_by_what_hair_stops(lit, fine_shadows, tmp_path):
    """Hair darkens the viewport's surfaces by the rest of the pass Hair Shadow as alpha of black; hair itself is
    unchanged.
    """
    bpy.ops.mesh.primitive_plane_add(size=12.0, location=(0.0, 0.0, -1.6))
    camera = bpy.context.scene.camera
    camera.location, camera.rotation_euler = (0.0, -7.0, 4.0), (1.1, 0.0, 0.0)
    bpy.data.objects["Sun"].rotation_euler = (0.0, 0.5, 0.0)
    lit.data.vellus.hair.strand_count, lit.data.vellus.hair.radius = 4000, 0.01
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
    matrices = scene.read_camera(bpy.context.scene, depsgraph, SIZE, SIZE)
    bpy.context.view_layer.vellus.has_hair_shadow = bpy.context.view_layer.vellus.has_hair_mask = True
    passes = rendered(tmp_path, film_transparent=True, resolution_x=SIZE, resolution_y=SIZE, sample_count=16)
    expected = 1.0 - passes["Hair Shadow"].mean(axis=-1)
    for per_side in (1, 2):
        plain, shadowed = (hair_picture.HairPicture((SIZE, SIZE), per_side) for _ in range(2))
        for _ in range(16 // per_side**2):
            plain.add_pass(drawn, *matrices)
            shadowed.add_pass(drawn, *matrices, is_shadowed=True)
        bare, dark = plain.read(), shadowed.read()
        np.testing.assert_allclose(dark[..., :3], bare[..., :3], atol=2e-3)
        assert (dark[..., 3] > bare[..., 3] - 1e-3).all() and dark.max() <= bare.max() + 1e-3
        shaded = (passes["Hair Mask"] < 1e-3) & (bare[..., 3] < 1e-3) & (expected > 0.1)
        assert shaded.sum() > 50
        # The pass spreads light that hair passes on, also to where the surface has no shadow.
        np.testing.assert_allclose(dark[..., 3][shaded].mean(), expected[shaded].mean(), rtol=0.15)


# ------------------------------------------------------------------------------------------------- when it is drawn


@pytest.fixture
def region(lit):
    """Return stand-ins for a region and its view at the scene's camera."""
    matrices = scene.read_camera(bpy.context.scene, bpy.context.evaluated_depsgraph_get(), SIZE, SIZE)
    names = ("view_matrix", "window_matrix")
    view = SimpleNamespace(**dict(zip(names, matrices, strict=True)))
    yield SimpleNamespace(width=SIZE, height=SIZE, as_pointer=lambda: 1), view
    region_pictures.picture_cache.clear()


def test_a_view_at_rest_is_drawn_until_it_is_fine_and_no_more(region, monkeypatch):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    drawn = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
    draws = []
    real = scene_drawing.draw_hair
    monkeypatch.setattr(scene_drawing, "draw_hair", lambda *args, **kwargs: (draws.append(1), real(*args, **kwargs)))
    place, view = region
    pass_count = hair_picture.SAMPLE_COUNT // hair_picture.samples_per_side() ** 2

    def redraw(count, is_see_through=False):
        draws.clear()
        for _ in range(count):
            viewport._picture(drawn, view, place, is_see_through)
        return len(draws)

    assert redraw(pass_count + 5) == pass_count
    assert redraw(5) == 0
    view.view_matrix = view.view_matrix + np.eye(4) * 1e-3
    assert redraw(pass_count + 5) == pass_count
    assert redraw(1, is_see_through=True) == 1
    place.width = SIZE - 10
    assert redraw(1, is_see_through=True) == 1


def test_blender_draws_hair_itself_only_where_this_does_not(hair):
    assert blenders_drawing(hair) == "nothing"
    hair.data.vellus.is_drawn = False
    bpy.context.view_layer.update()
    assert blenders_drawing(hair) == "TEXTURED"
    curves_objects.draw_natively(hair.data, False)
    assert blenders_drawing(hair) == "nothing" and not hair.hide_render and not hair.hide_select
    assert blenders_drawing(bpy.data.objects["Sphere"]) == "TEXTURED"


def blenders_drawing(shown):
    """Return how Blender draws an object: its display type, or nothing for bounds without a shape."""
    shapes = np.empty(len(bpy.data.objects), np.int32)
    bpy.data.objects.foreach_get("display_bounds_type", shapes)
    has_shape = shapes[bpy.data.objects.find(shown.name)] < 4
    return shown.display_type if has_shape or shown.display_type != "BOUNDS" else "nothing"


def test_meshes_that_are_no_surface_in_the_viewport_hide_nothing(sphere):
    space = next(a.spaces.active for s in bpy.data.screens for a in s.areas if a.type == "VIEW_3D")

    def count():
        bpy.context.view_layer.update()
        return len(drawn_meshes.read_drawn_meshes(bpy.context.evaluated_depsgraph_get(), space))

    assert count() == 1
    sphere.display_type = "WIRE"
    assert count() == 0
    sphere.display_type = "TEXTURED"
    sphere.hide_set(True)
    assert count() == 0


# ------------------------------------------------------------------------------------------------- shaders that fail


PROGRAMS = {
    "strands/guides.frag": lambda: scene_programs.guide_program.__wrapped__(),
    "visibility/strand_segments.comp": lambda: scene_programs.segments_program.__wrapped__(
        is_depth=True, is_round=True
    ),
}


@pytest.mark.parametrize("file", PROGRAMS)
def test_a_shader_that_does_not_compile_is_reported_once_with_file_and_line(file, tmp_path, monkeypatch):
    shutil.copytree(shaders.FOLDER, tmp_path / "shaders")
    broken = tmp_path / "shaders" / "strands" / "strip.glsl"
    text = broken.read_text()
    line = next(number for number, words in enumerate(text.splitlines(), 1) if "int row =" in words)
    broken.write_text(text.replace("int row =", "int row = nonsense; int other =", 1))
    monkeypatch.setattr(shaders, "FOLDER", tmp_path / "shaders")
    monkeypatch.setattr(shaders, "error_cache", Cache())
    compilations = []
    real = gpu.shader.create_from_info
    monkeypatch.setattr(gpu.shader, "create_from_info", lambda info: (compilations.append(1), real(info))[1])
    for _ in range(3):
        with pytest.raises(HairError, match=rf"{re.escape(file)} .*strands/strip\.glsl:{line}: .*nonsense"):
            PROGRAMS[file]()
    assert len(compilations) == 2  # and once more, to hear where


def test_a_complaint_is_found_in_what_vulkan_writes():
    log = (
        "00:02.605  gpu.shader       | ERROR pyGPU_Shader vertex: \n"
        "                            |       | python_shader.glsl:2: Error: 'x' : undeclared identifier\n"
    )
    vertex, fragment = [("a.vert", 1), ("strands/b.glsl", 7)], [("c.frag", 1), ("c.frag", 2)]
    assert shaders.complaint(log, vertex, fragment) == "strands/b.glsl:7: Error: 'x' : undeclared identifier"
    assert shaders.complaint(log.replace("vertex", "fragment"), vertex, fragment).startswith("c.frag:2: ")
    assert shaders.complaint("something else", vertex, fragment) is None


def test_undrawable_hair_is_reported_once(monkeypatch, capsys):
    def refuse(_context):
        raise HairError("The shader x.frag does not compile.")

    space = SimpleNamespace(shading=SimpleNamespace(type="SOLID"), overlay=SimpleNamespace(show_overlays=False))
    monkeypatch.setattr(viewport, "_draw_hair", refuse)
    notices.printed_cache.clear()
    monkeypatch.setattr(viewport, "bpy", SimpleNamespace(context=SimpleNamespace(space_data=space)))
    viewport.draw()
    viewport.draw()
    assert capsys.readouterr().err == "Vellus: The shader x.frag does not compile.\n"
    invalidation.clear()
    PROGRAMS["strands/guides.frag"]()  # others compile as before
