# SPDX-License-Identifier: GPL-3.0-or-later
"""With Comb Styled off, viewports show hair without styles while it is combed, and everything else has the styles."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.groom import pipeline
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import drawn_scene, hair_cache
from hair_addon.blender.settings import style_items
from hair_addon.core.styling import clump, curl, lean, steps
from tests.support.counting import counts_of
from tests.support.pictures import drawn_strands
from tests.support.reading import points, write_points


@pytest.fixture
def combed(hair, in_window):
    """Return curly hair in locks with guides in Sculpt Mode, to be shown straight."""
    hair.data.vellus.hair.point_count = 60
    for settings in (lean.Settings(amount=0.3), clump.Settings(size=0.2), curl.Settings(radius=0.02, pitch=0.1)):
        style_items.add(hair.data.vellus, settings)
    hair.data.vellus.guide_curves.vellus.shows_styles_while_combing = False
    bpy.context.view_layer.update()
    live_hair.write_all()
    bpy.ops.vellus.comb_guides()
    bpy.context.view_layer.update()
    yield hair
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def shown(hair):
    """Return (S, P, 3) in the texture that viewports draw."""
    return drawn_strands.places(hair_cache.strands_on_gpu(hair.data))


def stroke(combed_guides, steps=3):
    guides = bpy.data.objects["Guides"]
    for _ in range(steps):
        moved = points(guides)
        moved[combed_guides, 1:] += np.float32([0.0, 0.01, 0.02])
        write_points(guides, moved)
        yield


def made_anew(hair, is_styled):
    """Return the points (S, P, 3) interpolated from the current guides."""
    state = hair.data.vellus
    depsgraph = bpy.context.evaluated_depsgraph_get()  # this may update, so it comes before any mark
    styles, is_stale = style_items.styles_of(state), state.is_stale
    style_items.assign(state, styles if is_styled else ())
    try:
        return pipeline.bind_hair(*pipeline.inputs_of(hair.data), depsgraph, hair.data).points
    finally:
        style_items.assign(state, styles)
        state.is_stale = is_stale


def leave_sculpt_mode():
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()


@pytest.mark.parametrize("chosen", [[7], slice(None)], ids=["one guide", "all guides"])
def test_strokes_show_straight_hair_and_style_nothing(combed, monkeypatch, chosen):
    styled_before = points(combed)
    assert not np.allclose(shown(combed), styled_before, atol=0.01)
    launched, calls, real = [], counts_of(monkeypatch), steps.apply_steps
    monkeypatch.setattr(steps, "apply_steps", lambda *given: (launched.append(1), real(*given)))
    for _ in stroke(chosen):
        after = shown(combed)
    assert not launched and (calls["searches"], calls["uploads"], calls["writes"]) == (0, 0, 0)
    np.testing.assert_allclose(after, made_anew(combed, is_styled=False), atol=1e-6)
    assert np.array_equal(points(combed), styled_before)


def test_curves_are_styled_once_the_stroke_is_over(combed, monkeypatch):
    """After a stroke the Curves have styled hair for Blender's exporters, while the viewport shows it straight."""
    list(stroke([3, 4]))
    shown(combed)
    calls = counts_of(monkeypatch)
    live_hair.write_all()
    bpy.context.view_layer.update()
    shown(combed)
    assert (calls["writes"], calls["uploads"]) == (1, 0)
    wanted = made_anew(combed, is_styled=True)
    assert np.array_equal(points(combed), wanted)
    straight = made_anew(combed, is_styled=False)
    np.testing.assert_allclose(shown(combed), straight, atol=2e-6)
    list(stroke([3, 4], steps=1))
    np.testing.assert_allclose(shown(combed), made_anew(combed, is_styled=False), atol=2e-6)


def test_leaving_sculpt_mode_shows_styles(combed):
    list(stroke([3, 4]))
    leave_sculpt_mode()
    wanted = made_anew(combed, is_styled=True)
    np.testing.assert_allclose(shown(combed), wanted, atol=2e-6)
    live_hair.write_all()
    assert np.array_equal(points(combed), wanted)
    assert drawn_strands.are_drawn(shown(combed), wanted)


def test_saving_writes_styles_and_shows_straight_hair(combed, tmp_path):
    list(stroke([3, 4], steps=1))
    wanted, straight = made_anew(combed, is_styled=True), shown(combed)
    path = str(tmp_path / "combed.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    assert np.array_equal(shown(combed), straight)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert np.array_equal(points(bpy.data.objects["Hair"]), wanted)


def test_renders_pictures_and_exports_are_styled(combed):
    list(stroke([3, 4], steps=1))
    wanted, straight = made_anew(combed, is_styled=True), shown(combed)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    picture = drawn_scene.read(bpy.context.scene, bpy.context.view_layer, depsgraph)
    np.testing.assert_allclose(drawn_strands.places(picture.hair[0][0]), wanted, atol=2e-6)
    np.testing.assert_allclose(api.points(combed.data), wanted, atol=1e-6)
    list(stroke([3, 4], steps=1))
    wanted = made_anew(combed, is_styled=True)
    for handler in bpy.app.handlers.render_init:
        handler(bpy.context.scene)
    assert np.array_equal(points(combed), wanted)
    assert not np.allclose(shown(combed), wanted, atol=0.01) and not np.allclose(shown(combed), straight, atol=1e-3)


def test_the_switch_acts_at_once(combed):
    straight, switch = shown(combed), combed.data.vellus.guide_curves.vellus
    assert not np.allclose(straight, points(combed), atol=0.01)
    switch.shows_styles_while_combing = True
    bpy.context.view_layer.update()
    assert drawn_strands.are_drawn(shown(combed), points(combed))
    switch.shows_styles_while_combing = False
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(shown(combed), straight)


def test_a_slider_of_a_style_keeps_the_picture_straight(combed):
    list(stroke([3, 4], steps=1))
    straight = shown(combed)
    combed.data.vellus.styles["Curl"].curl.radius = 0.05
    bpy.context.view_layer.update()
    np.testing.assert_allclose(shown(combed), straight, atol=2e-6)
    leave_sculpt_mode()
    np.testing.assert_allclose(shown(combed), made_anew(combed, is_styled=True), atol=2e-6)


def test_undo_keeps_the_picture_straight(combed):
    straight = shown(combed)
    assert not np.allclose(straight, points(combed), atol=0.01)
    bpy.ops.ed.undo_push(message="before")
    list(stroke([3, 4]))
    bpy.ops.ed.undo_push(message="combed")
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    hair = bpy.data.objects["Hair"]
    assert bpy.data.objects["Guides"].mode == "SCULPT_CURVES"
    np.testing.assert_allclose(shown(hair), straight, atol=2e-6)
