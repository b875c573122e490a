# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Clipping Region clips hair, its outline, its guides and picking."""

from types import SimpleNamespace

import bpy
import gpu
import numpy as np
import pytest

from hair_addon.blender.data import scene
from hair_addon.blender.gpu import drawing
from hair_addon.blender.render import drawn_scene
from hair_addon.blender.render.viewport import guide_lines, region_pictures, selected_hair, viewport

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
