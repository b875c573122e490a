# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Clipping Region clips hair, its outline, its guides and picking; its Render Region limits the picture."""

from types import SimpleNamespace

import bpy
import gpu
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.gpu import display_transform, drawing
from hair_addon.blender.render import drawn_scene
from hair_addon.blender.render.viewport import (
    guide_lines,
    hair_picture,
    region_pictures,
    selected_hair,
    view_film,
    viewport,
)

SIZE = 96
NONE = (0.0, 0.0, 0.0, 0.0)
RIGHT = ((1.0, 0.0, 0.0, -0.1), *[NONE] * 5)  # leaves what is right of x = 0.1: the camera looks along Y


def read():
    bpy.context.view_layer.update()
    return drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())


def matrices():
    return scene.read_camera(bpy.context.scene, bpy.context.evaluated_depsgraph_get(), SIZE, SIZE)


def columns_of_plane():
    """Return (first, last) columns between which the plane of `RIGHT` crosses the hair."""
    to_clip = matrices()[1] @ matrices()[0]
    clip = np.array([[0.1, y, 0.0, 1.0] for y in (-1.6, 1.6)]) @ to_clip.T
    return sorted(SIZE * (0.5 * clip[:, 0] / clip[:, 3] + 0.5))


@pytest.fixture
def region(lit):
    """Return stand-ins for a region and its view at the scene's camera."""
    view = SimpleNamespace(**dict(zip(("view_matrix", "window_matrix"), matrices(), strict=True)))
    yield SimpleNamespace(width=SIZE, height=SIZE, as_pointer=lambda: 3), view
    region_pictures.picture_cache.clear()


def test_hair_and_what_is_clicked_are_cut_off(region):
    place, view = region
    drawn, (first, last) = read(), columns_of_plane()
    coverage = {}
    for planes in (None, RIGHT, None):
        picture = viewport._picture(drawn, view, place, False, clip_planes=planes).picture
        coverage[planes] = picture.read()[..., 3]
        assert picture.pass_count == 1  # another picture begins with other planes
        ys, xs = np.nonzero(coverage[planes] > 0.9)
        assert all(picture.hair_at(int(x), int(y)) == 0 for x, y in zip(xs[::50], ys[::50], strict=True))
        is_left = [picture.hair_at(x, SIZE // 2) is not None for x in range(int(first) - 3)]
        assert any(is_left) == (planes is None)
    whole, cut = coverage[None], coverage[RIGHT]
    assert not cut[:, : int(first) - 2].any() and whole[:, : int(first) - 2].any()
    np.testing.assert_array_equal(cut[:, int(last) + 4 :] > 0.0, whole[:, int(last) + 4 :] > 0.0)


def test_the_outline_is_that_of_what_is_left(region, lit):
    lit.select_set(True)
    place, view = region
    context = SimpleNamespace(
        space_data=SimpleNamespace(overlay=SimpleNamespace(show_overlays=True, show_outline_selected=True)),
        mode="OBJECT",
        view_layer=bpy.context.view_layer,
        preferences=bpy.context.preferences,
    )
    drawn = read()
    wanted = selected_hair.outlined(context, drawn)
    texture = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    target, lines = gpu.types.GPUFrameBuffer(color_slots=texture), []
    for planes in (None, RIGHT):
        for _ in range(4):
            kept = viewport._picture(drawn, view, place, False, wanted, clip_planes=planes)
        with target.bind():
            target.clear(color=NONE)
            kept.outline.show()
            lines.append(np.array(target.read_color(0, 0, SIZE, SIZE, 4, 0, "FLOAT"))[..., 3])
    away = int(columns_of_plane()[0] - wanted[1].reach - 2)
    assert lines[0][:, :away].any() and not lines[1][:, :away].any() and lines[1].any()


def test_guides_are_cut_off(lit):
    texture = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    depth = gpu.types.GPUTexture((SIZE, SIZE), format="DEPTH_COMPONENT32F")
    target = gpu.types.GPUFrameBuffer(color_slots=texture, depth_slot=depth)
    guides, view, lights = bpy.data.objects["Guides"], drawing.view_record(*matrices(), SIZE, 2.0), read().lights
    drawn = []
    for planes in (None, RIGHT):
        with target.bind():
            target.clear(color=NONE, depth=1.0)
            guide_lines.draw(guides, view, lights, planes)
            drawn.append(np.array(target.read_color(0, 0, SIZE, SIZE, 4, 0, "FLOAT"))[..., 3] > 0.0)
    first, last = (int(column) for column in columns_of_plane())
    assert drawn[0][:, : first - 2].any() and not drawn[1][:, : first - 2].any()
    np.testing.assert_array_equal(*(is_drawn[:, last + 3 :] for is_drawn in drawn))


@pytest.fixture
def space(lit):
    """Return a 3-D viewport with a Clipping Region."""
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    space = area.spaces.active
    space.region_3d.clip_planes, space.region_3d.use_clip_planes = RIGHT, True
    shading = space.shading.type
    yield space
    space.region_3d.use_clip_planes, space.shading.type = False, shading


@pytest.mark.parametrize("shading", ["WIREFRAME", "SOLID", "MATERIAL", "RENDERED"])
def test_it_cuts_off_where_blender_does(space, shading):
    """Strands are cut off where Blender cuts off surfaces, in two shading modes."""
    space.shading.type = shading
    context = SimpleNamespace(space_data=space, region_data=space.region_3d)
    is_clipped = shading in {"WIREFRAME", "SOLID"}
    found = viewport._clip_planes(context)
    assert np.allclose(found, RIGHT) if is_clipped else found is None
    space.region_3d.use_clip_planes = False
    assert viewport._clip_planes(context) is None


def shown_by(show, borders):
    """Return what a function of a border draws over nothing, for each border: [(SIZE, SIZE) alpha]."""
    texture = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    target, shown = gpu.types.GPUFrameBuffer(color_slots=texture), []
    with target.bind():
        for border in borders:
            target.clear(color=NONE)
            show(border)
            shown.append(np.array(target.read_color(0, 0, SIZE, SIZE, 4, 0, "FLOAT"))[..., 3])
    return shown


def test_material_preview_and_our_engine_draw_in_the_render_region_only(space, region):
    """Hair outside would float there, as EEVEE shows no surfaces outside of the region."""
    space.region_3d.use_clip_planes, (place, view) = False, region
    picture = viewport._picture(read(), view, place, False).picture
    context = SimpleNamespace(
        space_data=space, region=place, region_data=view, scene=bpy.context.scene, view_layer=bpy.context.view_layer
    )
    view.view_perspective, space.use_render_border = "PERSP", True
    space.render_border_min_x, space.render_border_max_x = 0.25, 0.75
    space.render_border_min_y, space.render_border_max_y = 0.5, 1.0
    borders = {}
    for space.shading.type in ("SOLID", "MATERIAL"):
        borders[space.shading.type] = viewport._border(context)
    space.use_render_border = False
    assert borders == {"SOLID": None, "MATERIAL": (24.0, 48.0, 72.0, 96.0)} and viewport._border(context) is None
    table = hair_picture.table_texture(display_transform.DisplayTransform.of(bpy.context.scene).table())
    film = view_film.ViewFilm((SIZE, SIZE), 1, is_transparent=True)
    film.add_pass(read(), *matrices())
    for show in (lambda border: picture.show(table, 1.0, depth_test="NONE", border=border), film.show):
        whole, part = shown_by(show, (None, borders["MATERIAL"]))
        expected = np.zeros_like(whole)
        expected[48:, 24:72] = whole[48:, 24:72]
        assert expected.any() and (whole > 0.0).sum() > 2 * (expected > 0.0).sum()
        np.testing.assert_array_equal(part, expected)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_in_camera_view_the_render_region_is_that_of_the_scene(space, region, kind):
    """It is relative to the frame of the camera, which may be smaller than the viewport."""
    blender_scene, (place, view) = bpy.context.scene, region
    render, camera = blender_scene.render, blender_scene.camera
    camera.data.type, camera.scale, camera.data.shift_x = kind, (2.0, 2.0, 2.0), 0.1
    render.resolution_x, render.resolution_y = 200, 200
    bpy.context.view_layer.update()
    world_to_view, view_to_clip = matrices()
    space.shading.type, view.view_perspective = "MATERIAL", "CAMERA"
    context = SimpleNamespace(space_data=space, region=place, region_data=view, scene=blender_scene)
    assert viewport._border(context) is None
    render.use_border, render.border_min_x, render.border_max_x = True, 0.25, 0.5
    render.border_min_y, render.border_max_y = 0.0, 0.75
    for part in (1.0, 0.5):
        view.view_matrix, view.window_matrix = world_to_view, np.diag([part, part, 1.0, 1.0]) @ view_to_clip
        expected = SIZE * (0.5 + part * (np.array([0.25, 0.0, 0.5, 0.75]) - 0.5))
        np.testing.assert_allclose(viewport._border(context), expected, atol=0.01)
