# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair is hidden from Blender's own drawing only in Material Preview and while its sliders are dragged."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import follow_nodes
from hair_addon.blender.groom import hidden_hair
from hair_addon.blender.host import running
from hair_addon.blender.live import handlers, hidden_previews, live_hair, moving_surfaces
from hair_addon.blender.render.viewport import viewport
from tests.blender.live.test_carried_strands import bend
from tests.blender.live.test_moving_surfaces import is_left_out, objects, view_space
from tests.support.pictures import render_probe
from tests.support.pictures.gpu_strands import CLOSE, drawn
from tests.support.reading import evaluated_points


@pytest.fixture
def posed(watched):
    """Return hair on a surface that a shape key bends, drawn by a window in Solid shading."""
    bend(watched.data.surface, 0.5)
    bpy.context.view_layer.update()
    moving_surfaces.resume()
    drawn(watched)
    yield watched
    view_space().shading.type = "SOLID"
    hidden_previews.unregister()
    hidden_previews.changed_cache.clear()


@pytest.fixture
def previewed(posed):
    view_space().shading.type = "MATERIAL"
    assert hidden_previews.follow() == hidden_previews._PERIOD
    return posed


def are_left_out():
    found = {is_left_out(curves_object) for curves_object in objects()}
    assert len(found) == 1
    return found.pop()


def test_material_preview_leaves_out_guides_and_hair_until_another_mode_is_chosen(previewed):
    assert are_left_out()
    shown = drawn(previewed)
    view_space().shading.type = "SOLID"
    assert hidden_previews.follow() is None
    assert not are_left_out()
    np.testing.assert_allclose(shown, evaluated_points(previewed), atol=CLOSE)


def test_hair_made_in_material_preview_is_left_out_too(previewed):
    surface = previewed.data.surface
    bpy.context.view_layer.objects.active = surface
    bpy.ops.vellus.add_hair(guide_count=20, strand_count=50, length=0.1)
    made = bpy.context.object
    assert made.data.surface == surface and not is_left_out(made)
    hidden_previews.follow()
    assert is_left_out(made)


def sculpt(_hair, _folder):
    bpy.context.view_layer.objects.active = objects()[0]
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")


def render_viewport(_hair, _folder):
    view_space().shading.type = "RENDERED"


@pytest.mark.parametrize("reason", [sculpt, render_viewport])
def test_whatever_else_shows_strands_gets_them(previewed, tmp_path, reason):
    reason(previewed, tmp_path)
    hidden_previews.follow()
    assert not are_left_out()
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def let_blender_draw(hair, _folder):
    hair.data.vellus.is_drawn = False


def add_modifier(hair, _folder):
    hair.modifiers.new("Artist", "NODES")


@pytest.mark.parametrize("reason", [let_blender_draw, add_modifier])
def test_hair_that_blender_shows_or_changes_gets_its_strands(previewed, tmp_path, reason):
    reason(previewed, tmp_path)
    hidden_previews.follow()
    guides, hair = objects()
    assert not is_left_out(hair) and is_left_out(guides)


def test_saved_files_and_undo_have_all_strands(previewed, tmp_path):
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, compress=False)
    assert not are_left_out()
    hidden_previews.follow()
    assert are_left_out()
    with bpy.data.libraries.load(path) as (_found, appended):
        appended.objects = ["Hair"]
    assert not follow_nodes.is_hidden(appended.objects[0])
    handlers.after_undo()
    assert not are_left_out()


def test_renders_have_all_strands(previewed, monkeypatch):
    monkeypatch.setattr(handlers, "_show_hidden", lambda: None)
    with render_probe.reading(lambda depsgraph: evaluated_points(previewed, depsgraph)) as render:
        (seen,) = render()
    assert is_left_out(previewed)
    hidden_hair.show()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(seen, evaluated_points(previewed))


def move_slider(hair, value):
    hair.data.vellus.hair.influence_distance = value
    bpy.context.view_layer.update()


def test_a_dragged_slider_hides_hair_until_it_rests(posed, monkeypatch):
    moments = [0.0]  # times of a clock that stands still while hair is made and drawn, at any processor speed
    monkeypatch.setattr(hidden_previews, "time", SimpleNamespace(monotonic=lambda: moments[-1]))
    posed.data.vellus.hair.automatic_influence = False
    view = viewport.view_cache.keep("seen", viewport._View(()))
    for step, value in enumerate((0.31, 0.32, 0.33)):
        drawn(posed)
        view.drawn = object()
        move_slider(posed, value)
        assert is_left_out(posed) == (step > 0)
    viewport.view_cache.clear()
    assert bpy.app.timers.is_registered(hidden_previews.follow)
    assert hidden_previews.follow() == hidden_previews._PERIOD and is_left_out(posed)
    moments.append(3.0 * hidden_previews._PERIOD)
    assert hidden_previews.follow() is None and not is_left_out(posed)


def test_scripts_that_move_sliders_read_strands(posed):
    """Scripts read current strands although nothing is drawn between their updates."""
    posed.data.vellus.hair.automatic_influence = False
    for value in (0.31, 0.32, 0.33):
        move_slider(posed, value)
        assert not is_left_out(posed)


def test_without_a_window_nothing_is_hidden(posed, monkeypatch):
    monkeypatch.setattr(running, "has_window", lambda: False)
    view_space().shading.type = "MATERIAL"
    hidden_previews.follow()
    live_hair.write_all()
    assert not are_left_out()
