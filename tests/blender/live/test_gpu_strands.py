# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands generated on the GPU during combing equal the strands written afterwards, with counted uploads."""

from itertools import cycle

import bpy
import gpu
import numpy as np
import pytest

from hair_addon.blender.data.strands import curves
from hair_addon.blender.gpu import ambient_visibility, shadows, strand_textures, surface_textures
from hair_addon.blender.gpu.programs import shaders
from hair_addon.blender.gpu.strands import device_choice, strand_bounds, strand_maker
from hair_addon.blender.groom import bindings, hidden_hair
from hair_addon.blender.host import running, scene_time
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import drawn_scene, gpu_strands, hair_cache
from hair_addon.blender.render.viewport import viewport
from hair_addon.blender.settings import preferences
from hair_addon.core.errors import HairError
from hair_addon.core.grooming import following
from tests.support.counting import counts_of
from tests.support.pictures import drawn_strands
from tests.support.pictures.gpu_strands import CLOSE, comb, drawn, grown, prepare
from tests.support.pictures.viewports import context_of, view3d
from tests.support.reading import points


def test_a_stroke_computes_nothing_here_and_is_written_without_a_jump(watched, monkeypatch):
    calls, computed = counts_of(monkeypatch), []
    real = following.weights_now
    monkeypatch.setattr(following, "weights_now", lambda *given: computed.append(1) or real(*given))
    monkeypatch.setattr(following, "follow_some", None)
    before = points(watched)
    for count in (2, 20, 60):
        comb(count)
        shown = drawn(watched)
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
    assert not computed
    loose = hair_cache.strands_on_gpu(watched.data).ball[1]
    np.testing.assert_array_equal(points(watched), before)
    live_hair.write_all()
    bpy.context.view_layer.update()
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 1}
    np.testing.assert_array_equal(drawn(watched), shown)  # nor is it uploaded
    assert calls["uploads"] == 0
    assert loose > hair_cache.strands_on_gpu(watched.data).ball[1]
    monkeypatch.undo()
    np.testing.assert_array_equal(points(watched), grown(watched))
    np.testing.assert_allclose(shown, points(watched), rtol=0.0, atol=CLOSE)
    assert np.abs(shown - before).max() > 0.01


def test_drawn_strands_take_eight_bytes_a_point(hair, window):
    """Drawn strands take eight bytes per point, and the memory of the programs that compute strands is counted."""
    drawn(hair)
    on_gpu = hair_cache.strands_on_gpu(hair.data)
    rows = on_gpu.texture.height * on_gpu.row_strands
    strands = strand_textures.bytes_of([on_gpu.texture, on_gpu.radii_texture])
    assert strands <= rows * 8 * (on_gpu.point_count + 1) + 4 * on_gpu.point_count
    before = hair_cache.drawn_bytes(hair.data)
    assert before > strands
    for _ in range(3):  # bound by the first, made on the GPU by the next
        comb(3)
        drawn(hair)
    assert hair_cache.drawn_bytes(hair.data) > before
    hair_cache.strand_cache.invalidate(hair.data.session_uid)
    assert hair_cache.drawn_bytes(hair.data) is None


def test_bounds_are_those_of_what_is_shown(watched):
    first = hair_cache.strands_on_gpu(watched.data)
    for along in (0.3, 0.3, -0.6):  # out of the first ones, and back
        comb(60, along=(along, 0.0, 0.0))
        shown = drawn(watched).reshape(-1, 3)
        bounds = hair_cache.strands_on_gpu(watched.data).box.exact
        np.testing.assert_allclose(bounds, [shown.min(axis=0), shown.max(axis=0)], rtol=0.0, atol=2e-6)
    assert first.texture is hair_cache.strands_on_gpu(watched.data).texture


def test_a_surface_that_is_read_again_at_rest_moves_and_uploads_nothing(watched, monkeypatch):
    comb(30)
    shown = drawn(watched)
    calls = counts_of(monkeypatch)
    hair_cache.invalidate_pose(watched.data.surface)
    np.testing.assert_array_equal(drawn(watched), shown)
    assert not any(calls.values())
    np.testing.assert_allclose(shown, grown(watched), rtol=0.0, atol=CLOSE)


@pytest.mark.parametrize(
    "settings",
    [
        {"keep_length": 0.2},
        {"angle_limit": 0.4, "length_limit": 1.5},
        {"neighbour_limit": 3},
        {"automatic_influence": False, "influence_distance": 0.4},
        {"radius": 3e-3, "tip_taper": 0.9},
    ],
    ids=lambda settings: next(iter(settings)),
)
def test_settings_of_weights_are_followed_where_strands_are_drawn(watched, settings, monkeypatch):
    comb(9)
    drawn(watched)
    calls, before = counts_of(monkeypatch), points(watched)
    for name, value in settings.items():
        setattr(watched.data.vellus.hair, name, value)
    bpy.context.view_layer.update()
    shown = drawn(watched)
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
    np.testing.assert_array_equal(points(watched), before)
    comb(20)
    shown = drawn(watched)
    on_gpu = hair_cache.strands_on_gpu(watched.data)
    radii = drawn_strands.radii(on_gpu)
    live_hair.write_all()
    assert (calls["searches"], calls["uploads"], calls["writes"]) == (0, 0, 1)
    monkeypatch.undo()
    assert getattr(bindings.of(watched.data).settings, name) == pytest.approx(value)
    np.testing.assert_array_equal(points(watched), grown(watched))
    np.testing.assert_allclose(shown, points(watched), rtol=0.0, atol=CLOSE)
    np.testing.assert_array_equal(radii.ravel(), curves.read_radii(watched.data))
    assert on_gpu.greatest_radius == radii.max()


def test_the_processor_moves_strands_that_the_gpu_made(watched, monkeypatch):
    """After the GPU is no longer chosen, the processor moves strands whose box nothing has read yet."""
    comb(60, along=(0.3, 0.0, 0.0))
    drawn(watched)
    live_hair.write_all()
    bpy.context.view_layer.update()
    drawn(watched)
    monkeypatch.setattr(gpu_strands, "are_wanted", lambda: False)
    hair_cache.choose_makers()
    on_gpu, calls = hair_cache.strands_on_gpu(watched.data), counts_of(monkeypatch)
    assert on_gpu.has_points and on_gpu.box.known is None
    comb(1)
    shown = drawn(watched).reshape(-1, 3)
    assert calls["moves"] == 1
    low, high = hair_cache.strands_on_gpu(watched.data).box.exact
    assert (low <= shown.min(axis=0) + 2e-6).all() and (shown.max(axis=0) - 2e-6 <= high).all()


def test_settings_of_roots_are_not(watched, monkeypatch):
    calls = counts_of(monkeypatch)
    watched.data.vellus.hair.neighbour_limit = 16  # more than were found
    bpy.context.view_layer.update()
    assert calls["searches"] == 1
    watched.data.vellus.hair.strand_count = 300
    bpy.context.view_layer.update()
    assert len(drawn(watched)) == 300


def test_strands_that_are_read_again_are_those_of_now(watched):
    comb(30)
    drawn(watched)
    hair_cache.strand_cache.clear()
    assert drawn_strands.are_drawn(drawn(watched), grown(watched))


def test_a_driver_that_lacks_something_uploads_as_before(watched, monkeypatch):
    def refuse(*_given):
        raise HairError("no images")

    monkeypatch.setattr(strand_maker, "new_maker", refuse)
    for count in (2, 3):
        comb(count)
        np.testing.assert_allclose(drawn(watched), grown(watched), rtol=0.0, atol=1e-6)


def test_one_edit_may_go_either_way(watched, monkeypatch):
    for choice in ("GPU", "COMPUTE", "AUTOMATIC", "COMPUTE"):
        monkeypatch.setattr(preferences, "stroke_device", lambda choice=choice: choice)
        drawn(watched)
        assert hair_cache.may_make(watched.data.session_uid) == (choice != "COMPUTE")
        comb(7)
        np.testing.assert_allclose(drawn(watched), grown(watched), rtol=0.0, atol=CLOSE)


@pytest.mark.parametrize(
    ("choice", "times", "is_wanted"),
    [
        ("AUTOMATIC", (1.0, 4.0), True),
        ("AUTOMATIC", (3.0, 4.0), False),
        ("GPU", (3.0, 4.0), True),
        ("GPU", (np.inf, 4.0), False),
        ("COMPUTE", (1.0, 4.0), False),
    ],
)
def test_the_user_may_choose(monkeypatch, choice, times, is_wanted):
    monkeypatch.setattr(device_choice, "times", lambda: times)
    monkeypatch.setattr(running, "has_window", lambda: True)
    monkeypatch.setattr(preferences, "stroke_device", lambda: choice)
    assert gpu_strands.are_wanted() == is_wanted


def test_nothing_is_measured_without_a_window(monkeypatch):
    monkeypatch.setattr(device_choice, "times", None)
    assert not gpu_strands.are_wanted()


@pytest.mark.usefixtures("made_anew")
def test_a_viewport_that_draws_hair_chooses(hair, window, monkeypatch):
    """The first drawing of hair in a viewport measures the GPU, and all later edits of bound hair use the choice."""
    viewport.view_cache.clear()
    calls, asked = counts_of(monkeypatch), []
    monkeypatch.setattr(device_choice, "times", lambda: asked.append(1) or (0.0, 1.0))

    def view():
        return viewport.drawn_scene_of(context_of(view3d())).hair[0][0]

    before = view()
    assert asked
    prepare()
    counted, draw = [], shadows.ShadowMaps.draw

    def drawn_maps(*given, **named):
        if "counted" in named:  # maps of lights, not of what hair and surfaces see of the world
            counted.append(named["counted"])
        return draw(*given, **named)

    monkeypatch.setattr(shadows.ShadowMaps, "draw", drawn_maps)
    for _ in range(3):
        comb(20)
        after = view()
        assert hair_cache.may_make(hair.data.session_uid)
        assert after is not before
        before = after
    assert calls["moves"] == 0
    assert counted[-1] == drawn_scene._DRAFT_COUNTED
    assert after.moved.turn == 3
    np.testing.assert_allclose(drawn(hair), grown(hair), rtol=0.0, atol=CLOSE)
    live_hair.write_all()
    bpy.context.view_layer.update()
    view()
    assert counted[-1] is None  # at rest maps count all strands


@pytest.mark.parametrize("is_paused", [False, True])
def test_a_row_of_edits_does_not_wait_for_its_own_strands(hair, window, monkeypatch, is_paused):
    """In a row of edits each frame reads the box of the former strands before the GPU makes new ones, and no other.

    Strands that leave the maps are in them with the next redraw, and at rest all boxes are exact. is_paused: whether
    Blender does not evaluate hair, as on a posed character.
    """
    viewport.view_cache.clear()
    monkeypatch.setattr(hidden_hair, "is_any_paused", lambda: is_paused)
    events, read, make = [], strand_bounds.StrandBounds._read, strand_maker.StrandMaker.make
    monkeypatch.setattr(strand_bounds.StrandBounds, "_read", lambda *given: events.append("read") or read(*given))
    monkeypatch.setattr(strand_maker.StrandMaker, "make", lambda *given: events.append("made") or make(*given))

    def view():
        return viewport.drawn_scene_of(context_of(view3d()))

    def edit(along):
        events.clear()
        comb(20, along)
        return view()

    def rest():
        live_hair.write_all()
        bpy.context.view_layer.update()
        view()

    view()
    edit((0.0, 0.01, 0.0))  # binds the hair
    prepare()
    rest()
    assert edit((0.0, 0.01, 0.0)).hair[0][0].box.is_exact or is_paused  # a single edit
    for turn in range(3):
        found = edit((0.0, 0.01, 0.0))
        assert events == (["read", "made"] if turn or is_paused else ["made"]), turn
        assert not found.hair[0][0].box.is_exact
        assert found.shadow_maps.contain(drawn_scene._placed(found.hair))
    events.clear()
    assert view() is found
    assert view() is found
    assert found.hair[0][0].box.is_exact
    assert events == ["read"]

    edit((0.0, 0.01, 0.0))
    found = edit((0.0, 0.0, 3.0))
    seen = found.hair[0][0].box
    assert not seen.is_exact
    assert np.ptp(seen.exact, axis=0)[2] > 1.5 * np.ptp(seen.former, axis=0)[2]
    fitting = view()
    assert fitting is not found
    assert fitting.shadow_maps.contain(drawn_scene._placed(fitting.hair))
    assert view() is fitting
    edit((0.0, 0.0, -3.0))
    rest()
    assert view().hair[0][0].box.is_exact


def test_what_played_is_drawn_as_at_rest_when_it_stops(hair, window, monkeypatch):
    viewport.view_cache.clear()
    measured, real = [], ambient_visibility.measure
    monkeypatch.setattr(ambient_visibility, "measure", lambda *given: measured.append(1) or real(*given))
    is_playing = [False]
    monkeypatch.setattr(scene_time, "is_playing", lambda: is_playing[0])

    def view():
        return viewport.drawn_scene_of(context_of(view3d()))

    comb(9)  # bound
    view()
    is_playing[0] = True
    for _ in range(2):
        comb(9)
        view()
        viewport.invalidate()  # more than hair
        view()
    live_hair.write_all()
    bpy.context.view_layer.update()
    view()
    measured.clear()
    viewport.invalidate()
    played = view()
    assert not measured
    is_playing[0] = False
    at_rest = view()
    assert measured == [1]
    assert at_rest is not played
    assert view() is at_rest


def test_a_stroke_uploads_its_guides_reads_a_box_and_allocates_nothing_else(watched, monkeypatch):
    """A stroke uploads one texture of twelve bytes per point of the guides, reads six numbers back and allocates
    nothing.
    """
    bpy.ops.object.light_add(type="SUN")

    def scene_now():
        return bpy.context.scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get()

    def frame(before):
        return drawn_scene.read(*scene_now(), before=before, is_draft=before is not None)

    shown = frame(None)
    to_and_fro = cycle([np.float32([0.0, 0.01, 0.02]), np.float32([0.0, -0.01, -0.02])])
    for _ in range(16):  # light has come round once
        comb(20, next(to_and_fro))
        shown = frame(shown)
    programs, maps, calls = len(shaders.program_cache), shown.shadow_maps, counts_of(monkeypatch)
    textures, sent, surfaces = [], [], []
    texture, buffer, draw_surface = gpu.types.GPUTexture, gpu.types.Buffer, surface_textures.draw_depth

    def sized(kind, size, values):
        if kind == "FLOAT":  # others are blocks of uniforms
            sent.append(size)
        return buffer(kind, size, values)

    monkeypatch.setattr(gpu.types, "GPUTexture", lambda *given, **named: textures.append(1) or texture(*given, **named))
    monkeypatch.setattr(gpu.types, "Buffer", sized)
    monkeypatch.setattr(surface_textures, "draw_depth", lambda *given: surfaces.append(1) or draw_surface(*given))
    for _ in range(3):
        comb(20, next(to_and_fro))
        shown = frame(shown)
    assert sent == [bindings.of(watched.data).guides.numpy().size] * 3
    assert len(textures) == 3
    assert len(shaders.program_cache) == programs
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
    assert shown.shadow_maps is maps
    assert not surfaces  # surfaces stay in the maps of the sun and of the world's directions
    moving = [np.array(map_.read()) for map_ in maps.samplers.values()]
    drawn_scene.read(*scene_now(), before=shown)
    for map_, wanted in zip(maps.samplers.values(), moving, strict=True):  # at rest shadows are the same
        np.testing.assert_array_equal(map_.read(), wanted)
