# SPDX-License-Identifier: GPL-3.0-or-later
"""Combing changes the picture immediately and Blender's data after the stroke; the test counts the work."""

import threading
from dataclasses import replace

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import curves
from hair_addon.blender.gpu import strand_textures
from hair_addon.blender.groom import bindings, pipeline
from hair_addon.blender.host import running
from hair_addon.blender.live import handlers, live_hair
from hair_addon.blender.render import hair_cache
from hair_addon.core.grooming import following
from hair_addon.core.interpolation.guide_weights import reach
from tests.support.counting import counts_of
from tests.support.pictures import drawn_strands
from tests.support.reading import attribute, points, write_points

pytestmark = pytest.mark.usefixtures("made_anew")


def drawn(hair):
    """Return (S, P, 3) in the texture that the shader reads."""
    return drawn_strands.places(hair_cache.strands_on_gpu(hair.data))


def stroke(guides, combed_guides, steps=4):
    """Move some guides aside in small steps with a depsgraph update each, as a brush does."""
    for _ in range(steps):
        combed = points(guides)
        combed[combed_guides, 1:] += np.float32([0.0, 0.01, 0.02])
        write_points(guides, combed)
        yield


def grown_from_nothing(hair):
    """Return the points (S, P, 3) interpolated from the current guides."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return pipeline.bind_hair(*pipeline.inputs_of(hair.data), depsgraph).points


def test_a_stroke_searches_nothing_and_writes_once(hair, in_window, monkeypatch):
    guides = bpy.data.objects["Guides"]
    drawn(hair)
    calls = counts_of(monkeypatch)
    before = points(hair)
    for step, _ in enumerate(stroke(guides, [3, 4, 5]), start=1):
        np.testing.assert_allclose(drawn(hair), grown(hair), atol=2e-6)
        assert calls == {"searches": 0, "uploads": 0, "moves": step, "writes": 0}
    assert np.array_equal(points(hair), before)
    live_hair.write_all()
    assert calls["writes"] == 1
    live_hair.write_all()
    assert calls["writes"] == 1
    bpy.context.view_layer.update()  # Blender reports what was written: it is no news
    drawn(hair)
    assert calls == {"searches": 0, "uploads": 0, "moves": 4, "writes": 1}
    monkeypatch.undo()
    assert np.array_equal(points(hair), grown_from_nothing(hair))


def grown(hair):
    """Return the points (S, P, 3) of all strands by their binding, for the current guides."""
    bound = bindings.of(hair.data)
    return following.follow_guides(
        bound.binding, curves.read_guides(hair.data.vellus.guide_curves, bound.surface, "cpu")
    ).numpy()


def test_a_redraw_waits_for_strands_that_grow(hair, in_window, monkeypatch):
    """A redraw waits while strands grow in other threads."""
    go_on, strands_now = threading.Event(), following.strands_now
    drawn(hair)
    for _ in stroke(bpy.data.objects["Guides"], slice(None), steps=1):
        drawn(hair)  # bound, and grown
    monkeypatch.setattr(
        following, "strands_now", lambda *given, **named: go_on.wait(60) and strands_now(*given, **named)
    )
    for _ in stroke(bpy.data.objects["Guides"], slice(None), steps=1):
        letting_go = threading.Timer(0.1, go_on.set)
        letting_go.start()
        shown = drawn(hair)
        letting_go.join()
        np.testing.assert_allclose(shown, grown(hair), atol=2e-6)


def test_only_strands_of_moved_guides_are_uploaded(hair, in_window, monkeypatch):
    guides = bpy.data.objects["Guides"]
    drawn(hair)
    moved, real = [], strand_textures.move_strands
    monkeypatch.setattr(
        strand_textures, "move_strands", lambda s, chosen, p: (moved.append(chosen), real(s, chosen, p))[1]
    )
    before = drawn(hair)
    for _ in stroke(guides, [7], steps=1):
        after = drawn(hair)
    has_moved = (after != before).any(axis=(1, 2))
    assert 0 < has_moved.sum() < len(before) / 2
    assert set(np.flatnonzero(has_moved)) <= set(moved[0])
    weights = bindings.of(hair.data).binding.guide_weights
    assert set(moved[0]) == set(np.flatnonzero((weights.indices.numpy() == 7).any(axis=1)))


def test_reach_is_the_inverse_of_indices(hair):
    weights = bindings.of(hair.data).binding.guide_weights
    indices = weights.indices.numpy()
    found = reach(weights, 60)
    for guide in range(60):
        strands = found.strands[found.starts[guide] : found.starts[guide + 1]]
        assert set(strands) == set(np.flatnonzero((indices == guide).any(axis=1)))


def test_without_a_window_hair_is_written_at_once(hair, monkeypatch):
    guides = bpy.data.objects["Guides"]
    calls = counts_of(monkeypatch)
    for step, _ in enumerate(stroke(guides, [3]), start=1):
        assert (calls["searches"], calls["writes"]) == (0, step)
    monkeypatch.undo()
    assert np.array_equal(points(hair), grown_from_nothing(hair))


def test_a_pause_writes_unless_the_stroke_goes_on(hair, in_window, monkeypatch):
    guides = bpy.data.objects["Guides"]
    before = points(hair)
    list(stroke(guides, [3], steps=1))
    assert bpy.app.timers.is_registered(live_hair.write_after_pause)
    monkeypatch.setattr(live_hair, "is_stroke_running", lambda: True)
    assert live_hair.write_after_pause() > 0.0
    assert np.array_equal(points(hair), before)
    monkeypatch.setattr(live_hair, "is_stroke_running", lambda: False)
    assert live_hair.write_after_pause() is None
    assert not np.array_equal(points(hair), before)
    assert not bpy.app.timers.is_registered(live_hair.write_after_pause)


def test_scripts_in_a_window_read_combed_hair_after_an_update(hair, in_window, monkeypatch):
    monkeypatch.setattr(running, "_is_in_script", lambda: True)
    before = points(hair)
    for _ in stroke(bpy.data.objects["Guides"], [3, 4, 5], steps=1):
        pass
    bpy.context.view_layer.update()
    assert np.array_equal(points(hair), grown_from_nothing(hair)) and not np.array_equal(points(hair), before)
    assert not bpy.app.timers.is_registered(live_hair.write_after_pause)


def test_a_pause_keeps_settings_that_changed_since_the_last_update(hair, in_window):
    """A script of a timer may change settings before hair with the former ones is written."""
    settings = hair.data.vellus.hair
    settings.seed = 9
    bpy.context.view_layer.update()
    settings.strand_count = 200
    assert live_hair.write_after_pause() > 0.0
    live_hair.write_all()
    assert settings.strand_count == 200 and hair.data.vellus.is_stale
    bpy.context.view_layer.update()
    assert live_hair.write_after_pause() is None
    assert len(hair.data.curves) == settings.strand_count == 200 and not hair.data.vellus.is_stale


@pytest.mark.parametrize("reader", ["save", "render", "unregister"])
def test_hair_is_written_before_it_is_read(hair, in_window, reader, tmp_path):
    guides = bpy.data.objects["Guides"]
    list(stroke(guides, [3], steps=1))
    wanted = drawn(hair)
    if reader == "save":
        path = str(tmp_path / "combed.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
    elif reader == "render":
        for handler in bpy.app.handlers.render_init:
            handler(bpy.context.scene)
    else:
        handlers.unregister()
        handlers.register()
    np.testing.assert_allclose(points(bpy.data.objects["Hair"]), wanted, atol=2e-6)


_SLIDERS = {
    "neighbour_limit": (7, 5, 3),
    "influence_distance": (0.3, 0.5, 0.8),
    "keep_length": (0.5, 0.2, 0.0),
    "angle_limit": (0.5, 0.3, 0.1),
    "length_limit": (1.3, 1.1, 1.01),
}


@pytest.mark.parametrize(("name", "values"), _SLIDERS.items())
def test_sliders_that_keep_roots_search_nothing_and_write_when_they_are_let_go(
    hair, in_window, monkeypatch, name, values
):
    list(stroke(bpy.data.objects["Guides"], range(0, 60, 2), steps=2))  # guides that differ
    settings = hair.data.vellus.hair
    settings.automatic_influence = name != "influence_distance"
    bpy.context.view_layer.update()
    live_hair.write_all()
    drawn(hair)
    calls = counts_of(monkeypatch)
    before, roots = points(hair), attribute(hair, "root_triangle")
    for value in values:
        setattr(settings, name, value)
        bpy.context.view_layer.update()
        assert not drawn_strands.are_drawn(drawn(hair), before)
    for _ in range(3):
        bpy.context.view_layer.update()
    assert (calls["searches"], calls["uploads"], calls["writes"]) == (0, 3, 0)
    live_hair.write_all()
    assert calls["writes"] == 1
    assert drawn_strands.are_drawn(drawn(hair), points(hair))
    assert np.array_equal(attribute(hair, "root_triangle"), roots)
    assert not hair.data.vellus.is_stale
    assert np.array_equal(points(hair), grown_from_nothing(hair))


def test_more_guides_for_a_strand_are_searched_for(hair, in_window, monkeypatch):
    calls = counts_of(monkeypatch)
    hair.data.vellus.hair.neighbour_limit = 12
    bpy.context.view_layer.update()
    assert calls["searches"] == 1
    live_hair.write_all()
    assert np.array_equal(points(hair), grown_from_nothing(hair))


def test_a_guide_slider_that_keeps_roots_searches_nothing(hair, monkeypatch):
    guides = bpy.data.objects["Guides"]
    before = points(hair)
    calls = counts_of(monkeypatch)
    guides.data.vellus.guides.gravity = 0.1
    bpy.context.view_layer.update()
    assert calls["searches"] == 0
    assert not np.array_equal(points(hair), before)
    assert np.array_equal(points(hair)[:, 0], before[:, 0])


def test_a_guide_that_slides_binds_the_hair_again(hair):
    guides = bpy.data.objects["Guides"]
    combed = points(guides)
    combed[0] = -combed[0]
    write_points(guides, combed)
    assert np.array_equal(points(hair), grown_from_nothing(hair))


def test_hair_from_a_file_follows_by_the_roots_that_it_stores(hair, tmp_path):
    path = str(tmp_path / "groom.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    hair, guides = bpy.data.objects["Hair"], bpy.data.objects["Guides"]
    roots = attribute(hair, "root_barycentric", 3)
    list(stroke(guides, [3], steps=2))
    assert np.array_equal(attribute(hair, "root_barycentric", 3), roots)
    assert np.array_equal(points(hair), grown_from_nothing(hair))


@pytest.mark.parametrize("is_reported_first", [True, False])
def test_own_writes_are_no_news(hair, monkeypatch, is_reported_first):
    """The add-on's own writes are not reported as changes; changes by others are, before and after Blender reports
    our write.
    """
    calls = counts_of(monkeypatch)
    pipeline.interpolate_hair(*pipeline.inputs_of(hair.data), bpy.context.evaluated_depsgraph_get(), hair.data)
    if is_reported_first:
        bpy.context.view_layer.update()
        assert (calls["writes"], calls["searches"]) == (1, 0)
        assert bindings.of(hair.data) is not None
    sculpted = points(hair)
    sculpted[7, -1] += 0.1
    write_points(hair, sculpted)
    assert bindings.of(hair.data) is None


def test_regenerated_hair_is_redrawn(hair, monkeypatch):
    before = drawn(hair)
    calls = counts_of(monkeypatch)
    settings = replace(pipeline.inputs_of(hair.data)[1], seed=7)
    pipeline.interpolate_hair(hair.data.vellus.guide_curves, settings, bpy.context.evaluated_depsgraph_get(), hair.data)
    bpy.context.view_layer.update()
    assert drawn_strands.are_drawn(drawn(hair), points(hair)) and not np.array_equal(drawn(hair), before)
    assert (calls["uploads"], calls["moves"]) == (1, 0)


def test_hair_that_was_sculpted_itself_is_kept(hair):
    guides = bpy.data.objects["Guides"]
    sculpted = points(hair)
    sculpted[:, -1] += 0.1
    write_points(hair, sculpted)
    list(stroke(guides, [3], steps=1))
    assert np.array_equal(points(hair), sculpted)
    assert "Regenerate Strands" in hair.data.vellus.status


@pytest.mark.parametrize("is_written_before_undo_push", [True, False])
def test_undo_and_redo_keep_hair_and_guides_together(hair, in_window, is_written_before_undo_push):
    """Undo and redo keep hair and guides together, whether a stroke's undo step is pushed before or after the hair
    is written.
    """
    bpy.ops.ed.undo_push(message="grown")
    before = points(hair)
    list(stroke(bpy.data.objects["Guides"], [3]))
    wanted = drawn(hair)
    if is_written_before_undo_push:
        live_hair.write_all()
    bpy.ops.ed.undo_push(message="combed")
    live_hair.write_all()
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    live_hair.write_all()
    assert np.array_equal(points(bpy.data.objects["Hair"]), before)
    assert drawn_strands.are_drawn(drawn(bpy.data.objects["Hair"]), before)
    bpy.ops.ed.redo()
    bpy.context.view_layer.update()
    live_hair.write_all()
    assert drawn_strands.are_drawn(wanted, points(bpy.data.objects["Hair"]))
    assert np.array_equal(drawn(bpy.data.objects["Hair"]), wanted)


def test_a_stroke_on_one_groom_leaves_another_alone(hair, sphere, in_window, monkeypatch):
    bpy.context.view_layer.objects.active = sphere
    bpy.ops.vellus.distribute_guides(guide_count=30, length=0.2)
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides.001"]
    bpy.ops.vellus.interpolate_hair(strand_count=100)
    other = bpy.data.objects["Hair.001"]
    drawn(hair), drawn(other)
    calls = counts_of(monkeypatch)
    list(stroke(bpy.data.objects["Guides"], [3], steps=1))
    drawn(other)
    assert calls["moves"] == 0
    drawn(hair)
    assert calls == {"searches": 0, "uploads": 0, "moves": 1, "writes": 0}


def test_a_guide_that_a_brush_added_is_rooted(hair, sphere):
    guides = bpy.data.objects["Guides"].data
    guides.add_curves([41])
    added = np.linspace([0.0, 0.0, -1.0], [0.0, 0.0, -1.5], 41, dtype=np.float32)
    every = points(bpy.data.objects["Guides"])
    every[-1] = added
    write_points(bpy.data.objects["Guides"], every)
    assert attribute(bpy.data.objects["Guides"], "root_barycentric", 3)[-1].sum() == pytest.approx(1.0, abs=1e-5)
    assert np.array_equal(points(hair), grown_from_nothing(hair))


def test_changes_before_a_pending_write_are_evaluated(hair, sphere, in_window):
    for size in (1.1, 1.3):
        sphere.data.transform(((size, 0, 0, 0), (0, size, 0, 0), (0, 0, size, 0), (0, 0, 0, 1)))
        sphere.data.update()
        bpy.context.view_layer.update()
    np.testing.assert_allclose(np.linalg.norm(drawn(hair)[:, 0], axis=1), 1.43, atol=0.01)
    live_hair.write_all()
    assert drawn_strands.are_drawn(drawn(hair), points(hair))


def test_a_file_saved_in_the_middle_of_a_stroke_gets_its_hair(hair, in_window, tmp_path, monkeypatch):
    list(stroke(bpy.data.objects["Guides"], [3]))
    wanted = drawn(hair)
    monkeypatch.setattr(live_hair, "write_all", lambda: None)  # as an automatic save does
    path = str(tmp_path / "autosave.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    monkeypatch.undo()
    bpy.ops.wm.open_mainfile(filepath=path)
    bpy.data.objects["Sphere"].location.x = 1.0  # without a window Blender reports nothing before something changes
    bpy.context.view_layer.update()
    np.testing.assert_allclose(points(bpy.data.objects["Hair"]), wanted, atol=2e-6)
