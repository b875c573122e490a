# SPDX-License-Identifier: GPL-3.0-or-later
"""The outline of selected hair has the right position, color, visibility and cost."""

from dataclasses import replace
from types import SimpleNamespace

import bpy
import gpu
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, label

from hair_addon.blender.data import scene
from hair_addon.blender.render import drawn_scene, scene_drawing
from hair_addon.blender.render.viewport import hair_picture, region_pictures, selected_hair, viewport
from hair_addon.blender.render.viewport.outline import HairOutline, OutlineStyle

SIZE = 160
ACTIVE, SELECTED = (1.0, 0.5, 0.0), (0.0, 0.5, 1.0)
STYLE = OutlineStyle(ACTIVE, SELECTED, width=2.0, scale=1.0)


def read():
    bpy.context.view_layer.update()
    return drawn_scene.read(bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())


def matrices():
    return scene.read_camera(bpy.context.scene, bpy.context.evaluated_depsgraph_get(), SIZE, SIZE)


def shown(show):
    """Return (SIZE, SIZE, 4) display colors that are laid over a black viewport."""
    texture = gpu.types.GPUTexture((SIZE, SIZE), format="RGBA32F")
    target = gpu.types.GPUFrameBuffer(color_slots=texture)
    with target.bind():
        target.clear(color=(0.0, 0.0, 0.0, 0.0))
        show()
        pixels = np.array(target.read_color(0, 0, SIZE, SIZE, 4, 0, "FLOAT"))
    pixels[..., :3] = np.clip(pixels[..., :3], 0.0, None) ** (1.0 / 2.2)
    return pixels


def outlined(drawn, channels, style=STYLE):
    """Return (picture of the outline, (SIZE, SIZE) whether any sample of a pixel shows hair) after enough passes."""
    picture, outline = hair_picture.HairPicture((SIZE, SIZE), 2), HairOutline((SIZE, SIZE))
    outline.restart(channels, style)
    while not outline.is_fine:
        picture.add_pass(drawn, *matrices(), outline=outline)
    return shown(outline.show), picture.read()[..., 3] > 0.0


@pytest.fixture
def bare(lit):
    """Return the hair without its surface, which would hide some of it."""
    lit.select_set(True)
    return replace(read(), surfaces=[], surface_owners=())


def test_the_line_surrounds_the_hair_at_its_gap(bare):
    line, is_hair = outlined(bare, {0: 0})
    distance = distance_transform_edt(~is_hair)
    opacity = line[..., 3]
    assert is_hair.sum() > 1000
    # A pixel may be covered in part, so the line may be nearer or further by half of one.
    assert (opacity[is_hair] == 0.0).all()
    assert (opacity[distance > STYLE.gap + STYLE.width + 1.5] == 0.0).all()
    middle = STYLE.gap + 0.5 * STYLE.width
    assert (opacity[abs(distance - middle) < 0.3] > 0.5).all()
    # It is closed: no way leads from the corner of the picture to the hair but across the line.
    parts, _count = label(opacity < 0.2)
    assert not (is_hair & (parts == parts[0, 0])).any()


def test_active_hair_and_other_selected_hair_have_the_themes_colours(bare):
    for channel, expected in ((0, ACTIVE), (1, SELECTED)):
        line, _is_hair = outlined(bare, {0: channel})
        opaque = line[line[..., 3] > 0.99][:, :3]
        assert len(opaque) > 100 and np.abs(opaque - expected).max() < 0.01


def test_hair_that_is_not_selected_has_no_line(lit):
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.ops.vellus.interpolate_hair(strand_count=50)
    bpy.data.objects["Hair.001"].location = (3.0, 0.0, 0.0)
    drawn = read()
    assert len(drawn.hair) == 2
    line, _is_hair = outlined(drawn, {0: 0, 1: 1})
    alone, _is_hair = outlined(drawn, {0: 0})
    is_active = np.abs(line[..., :3] - ACTIVE).max(axis=-1) < 0.02
    assert is_active.sum() > 100 and (np.abs(line[..., :3] - SELECTED).max(axis=-1) < 0.02).sum() > 100
    assert (np.abs(alone[..., :3] - SELECTED).max(axis=-1) < 0.02).sum() == 0
    assert ((np.abs(alone[..., :3] - ACTIVE).max(axis=-1) < 0.02) >= is_active).all()


def test_where_something_hides_the_hair_the_line_is_faint(bare):
    """The outline is faint where a wall hides the hair, and opaque there in X-ray views."""
    line, _is_hair = outlined(bare, {0: 0})
    bpy.ops.mesh.primitive_cube_add(size=4.0, location=(-2.0, -5.0, 0.0), scale=(1.0, 0.01, 1.0))
    walled, _is_hair = outlined(read(), {0: 0})
    left, right = np.s_[:, : SIZE // 2 - 8], np.s_[:, SIZE // 2 + 8 :]
    opaque = line[..., 3] > 0.99
    np.testing.assert_allclose(walled[left][opaque[left]][:, 3], 0.35, atol=0.01)
    assert np.median(walled[right][opaque[right]][:, 3]) > 0.99
    see_through = OutlineStyle(ACTIVE, SELECTED, 2.0, 1.0, is_see_through=True)
    np.testing.assert_allclose(outlined(read(), {0: 0}, see_through)[0][..., 3][opaque], 1.0, atol=0.01)


# ------------------------------------------------------------------------------------------------ when it is drawn


class Context:
    """The present context, with a viewport."""

    def __init__(self, **overlay):
        overlay = {"show_overlays": True, "show_outline_selected": True} | overlay
        self.space_data = SimpleNamespace(overlay=SimpleNamespace(**overlay))

    def __getattr__(self, name):
        return getattr(bpy.context, name)


def test_it_is_drawn_of_what_is_selected_where_the_viewport_outlines_it(lit):
    lit.select_set(False)
    assert selected_hair.outlined(Context(), read()) is None
    lit.select_set(True)
    channels, style = selected_hair.outlined(Context(), read())
    assert channels == ((0, 0),) and style.active_color == pytest.approx(
        tuple(bpy.context.preferences.themes[0].view_3d.object_active)
    )
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    assert selected_hair.outlined(Context(), read())[0] == ((0, 1),)
    for overlay in ("show_overlays", "show_outline_selected"):
        assert selected_hair.outlined(Context(**{overlay: False}), read()) is None
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    assert selected_hair.outlined(Context(), read()) is None


@pytest.fixture
def region(lit):
    """Return stand-ins for a region and its view at the scene's camera."""
    view = SimpleNamespace(**dict(zip(("view_matrix", "window_matrix"), matrices(), strict=True)))
    yield SimpleNamespace(width=SIZE, height=SIZE, as_pointer=lambda: 2), view
    region_pictures.picture_cache.clear()


def test_a_redraw_finds_hair_again_only_for_another_outline(region, lit, monkeypatch):
    lit.select_set(True)
    drawn, finds, measures = read(), [], []
    real, real_measure = scene_drawing.find_hair, HairOutline._measure
    monkeypatch.setattr(scene_drawing, "find_hair", lambda *arguments: (finds.append(1), real(*arguments)))
    monkeypatch.setattr(HairOutline, "_measure", lambda outline: (measures.append(1), real_measure(outline)))
    place, view = region
    wanted = selected_hair.outlined(Context(), drawn)

    def redraw(count, outline):
        finds.clear(), measures.clear()
        for _ in range(count):
            kept = viewport._picture(drawn, view, place, False, outline)
            if kept.outline is not None:
                shown(kept.outline.show)
        return len(finds), len(measures)

    assert redraw(40, None) == (0, 0)
    assert kept_outline() is None
    first = redraw(40, wanted)
    assert first[0] == first[1] == 4
    assert redraw(5, wanted) == (0, 0)
    bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
    assert redraw(40, selected_hair.outlined(Context(), drawn)) == (4, 4)
    assert redraw(1, None) == (0, 0) and kept_outline() is None


def kept_outline():
    return region_pictures.picture_cache.values()[0].outline


def test_over_another_engines_picture_it_is_the_same(bare, monkeypatch):
    monkeypatch.setattr(hair_picture, "samples_per_side", lambda: 2)
    expected, _is_hair = outlined(bare, {0: 0})
    lone = selected_hair.LoneOutline((SIZE, SIZE))
    lone.restart({0: 0}, STYLE)
    while not lone.is_fine:
        lone.add_pass(bare, *matrices())
    np.testing.assert_array_equal(shown(lone.show), expected)
