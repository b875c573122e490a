# SPDX-License-Identifier: GPL-3.0-or-later
"""Styled hair on the GPU: strokes, sliders and painted masks compute and upload no strands on the processor."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.gpu.programs import shaders, uniforms
from hair_addon.blender.gpu.strands import style_maker
from hair_addon.blender.groom import bindings
from hair_addon.blender.live import live_hair
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import style_items
from hair_addon.core.grooming import following
from hair_addon.core.styling import bend, clump, curl, frizz, lean, wet
from tests.support.counting import counts_of
from tests.support.pictures import drawn_strands
from tests.support.pictures.gpu_strands import CLOSE, comb, drawn, grown, prepare
from tests.support.reading import points
from tests.support.scenes import even_guides


def test_styles_that_the_gpu_cannot_apply_are_made_as_before(watched, monkeypatch):
    monkeypatch.setattr(uniforms, "MOST_STEPS", 1)
    assert hair_cache.may_make(watched.data.session_uid)
    style_items.add(watched.data.vellus, curl.Settings())
    style_items.add(watched.data.vellus, frizz.Settings())
    bpy.context.view_layer.update()
    drawn(watched)
    assert not hair_cache.may_make(watched.data.session_uid)
    comb(60)
    assert drawn_strands.are_drawn(drawn(watched), bindings.of(watched.data).points)


# [m] that single strands of clumps may differ by, where they turn past a center; other settings move hair by far more.
SENSITIVE = 1e-4


def add_styles(hair, *styles):
    """Add styles to hair, and draw it."""
    for settings in styles:
        style_items.add(hair.data.vellus, settings)
    written(hair)
    drawn(hair)
    assert hair_cache.may_make(hair.data.session_uid)


def written(hair):
    """Return (S, P, 3), the points of Curves once an interaction has ended."""
    bpy.context.view_layer.update()
    live_hair.write_all()
    bpy.context.view_layer.update()
    return points(hair)


@pytest.mark.parametrize(
    "styles",
    [
        (lean.Settings(amount=0.3),),
        (clump.Settings(size=0.3, levels=1), curl.Settings()),
        (clump.Settings(size=0.3, centers="GUIDES"),),
    ],
)
def test_a_stroke_on_styled_hair_computes_nothing_here(watched, monkeypatch, styles):
    """A stroke on styled hair computes only leaning guides on the processor, and the written strands equal the shown
    ones.
    """
    add_styles(watched, *styles)
    with monkeypatch.context() as counted:
        calls = counts_of(counted)
        counted.setattr(following, "strands_now", None)
        for count in (2, 60):
            comb(count)
            shown = drawn(watched)
        assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
    np.testing.assert_allclose(shown, written(watched), rtol=0.0, atol=CLOSE)
    np.testing.assert_array_equal(drawn(watched), shown)
    assert np.abs(shown - grown(watched)).max() > 0.01  # without styles


def test_edits_wait_for_no_program(watched, monkeypatch):
    """Edits wait for no program: programs are compiled one at a time at rest, and until then Warp generates the
    strands.
    """
    watched.data.vellus.hair.point_count = 19  # as nowhere else
    bpy.context.view_layer.update()
    with monkeypatch.context() as undisturbed:
        undisturbed.setattr(hair_cache, "prepare_makers", lambda: False)  # no viewport comes to rest
        known, calls = [len(shaders.program_cache)], counts_of(undisturbed)
        for settings in (clump.Settings(size=0.3, levels=1), bend.Settings()):
            style_items.add(watched.data.vellus, settings)
        written(watched)
        drawn(watched)
        assert not hair_cache.may_make(watched.data.session_uid)
        comb(5)
        assert drawn_strands.are_drawn(drawn(watched), bindings.of(watched.data).points)
        assert len(shaders.program_cache) == known[-1] and calls["uploads"] + calls["moves"] > 0
    while hair_cache.prepare_makers():
        known.append(len(shaders.program_cache))
    assert known[-1] > known[0] and set(np.diff(known)) == {1}
    calls = counts_of(monkeypatch)
    comb(5)
    drawn(watched)
    assert len(shaders.program_cache) == known[-1]
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}


def test_hair_of_another_number_of_points_than_its_guides(watched, monkeypatch):
    watched.data.vellus.hair.point_count = 20
    add_styles(watched)
    calls = counts_of(monkeypatch)
    comb(20)
    assert drawn(watched).shape[1] == 20
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
    np.testing.assert_allclose(drawn(watched), written(watched).reshape(-1, 20, 3), rtol=0.0, atol=CLOSE)


def slide(hair, place, name, value):
    """Move the slider of a style's setting."""
    setattr(style_items.group_of(hair.data.vellus.styles[place]), name, value)
    bpy.context.view_layer.update()


def test_a_slider_of_a_style_computes_no_strands_here(watched, monkeypatch):
    add_styles(watched, clump.Settings(size=0.3, levels=1), curl.Settings(radius=0.02, pitch=0.1))
    first = drawn(watched)
    releases, release = [], style_maker.StyleMaker.release_memory
    with monkeypatch.context() as counted:
        calls = counts_of(counted)
        counted.setattr(following, "strands_now", None)
        slide(watched, 1, "radius", 0.03)
        drawn(watched)
        monkeypatch.setattr(
            style_maker.StyleMaker, "release_memory", lambda self: releases.append(self) or release(self)
        )
        slide(watched, 0, "amount", 0.4)
        comb(3)  # and combing goes on from there
        shown = drawn(watched)
        assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
    assert not releases  # memory of the slider is released once hair is written
    assert np.abs(shown - first).max() > 0.01
    np.testing.assert_allclose(shown, written(watched), rtol=0.0, atol=CLOSE)
    assert releases
    np.testing.assert_array_equal(drawn(watched), shown)


@even_guides
@pytest.mark.parametrize("settings", [{"keep_length": 0.2}, {"neighbour_limit": 3, "radius": 3e-3}])
def test_settings_of_weights_are_followed_with_all_styles(watched, settings, monkeypatch):
    add_styles(watched, clump.Settings(size=0.3, levels=1), lean.Settings(amount=0.2), curl.Settings(radius=0.02))
    first, calls = drawn(watched), counts_of(monkeypatch)
    for name, value in settings.items():
        setattr(watched.data.vellus.hair, name, value)
    bpy.context.view_layer.update()
    prepare()
    comb(9)
    slide(watched, 0, "amount", 0.7)
    shown = drawn(watched)
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
    assert np.abs(shown - first).max() > 0.01
    np.testing.assert_allclose(shown, written(watched), rtol=0.0, atol=SENSITIVE)
    bindings.invalidate(watched.data)
    watched.data.vellus.hair.seed += 1  # all of it anew
    watched.data.vellus.hair.seed -= 1
    bpy.context.view_layer.update()
    np.testing.assert_allclose(written(watched), shown, rtol=0.0, atol=SENSITIVE)


def test_a_mask_that_is_painted_uploads_no_strands(watched, monkeypatch):
    add_styles(watched, bend.Settings(angle=2.0))
    surface = watched.data.surface
    bpy.context.view_layer.objects.active = surface
    group = surface.vertex_groups.new(name="Mask")
    slide(watched, 0, "mask", "Mask")
    drawn(watched)
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    shown, calls = [], counts_of(monkeypatch)
    for weight in (1.0, 0.4):
        group.add(range(len(surface.data.vertices) // 2), weight, "REPLACE")
        surface.data.update()
        bpy.context.view_layer.update()
        shown.append(drawn(watched))
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
    assert np.abs(shown[1] - shown[0]).max() > 0.01
    np.testing.assert_allclose(shown[1], written(watched), rtol=0.0, atol=CLOSE)


def test_a_style_that_is_switched_off_and_on(watched):
    """A style that is switched off and on has a program for each set of kinds; styles of guides alone need no
    program.
    """
    add_styles(watched, bend.Settings(), lean.Settings(amount=0.5))
    for place, is_on in ((0, False), (1, False), (0, True), (1, True)):
        slide(watched, place, "is_on", is_on)
        shown = drawn(watched)
        np.testing.assert_allclose(shown, written(watched), rtol=0.0, atol=CLOSE)


def test_wetness_and_the_radii_that_swell_with_it(watched, monkeypatch):
    """A change of wetness uploads one number per strand if strands differ in wetness, and the radii swell with it."""
    add_styles(watched, wet.Settings(lock=0.3, amount=0.2))
    calls = counts_of(monkeypatch)
    for amount, vary in ((0.9, 0.0), (0.9, 0.5), (0.5, 0.3), (0.5, 0.0)):
        slide(watched, 0, "amount", amount)
        slide(watched, 0, "vary", vary)
        shown = drawn(watched)
        on_gpu, bound = hair_cache.strands_on_gpu(watched.data), bindings.of(watched.data)
        radii = drawn_strands.radii(on_gpu)
        np.testing.assert_array_equal(radii, np.broadcast_to(bound.radii, radii.shape))
        assert on_gpu.greatest_radius == bound.radii.max()
        assert (on_gpu.wetness is None) == (vary == 0.0)
        if vary > 0.0:
            texels = np.array(on_gpu.wetness.read(), np.float32).ravel()[: on_gpu.strand_count]
            np.testing.assert_array_equal(texels, bound.styles.wetness)
    assert calls == {"searches": 0, "uploads": 0, "moves": 0, "writes": 0}
    np.testing.assert_allclose(shown, written(watched), rtol=0.0, atol=CLOSE)
    np.testing.assert_array_equal(drawn(watched), shown)
    assert calls["uploads"] == 0
