# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared wetness of hair and guides: the largest of look, Wet styles and dynamics, in shading and motion."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.blender.settings import properties, shared_wetness, style_items
from hair_addon.blender.ui import panels
from tests.support.interface.layout import draw_all
from tests.support.reading import points


@pytest.fixture
def guide_curves(hair):
    return hair.data.vellus.guide_curves


def wet(hair, amount):
    """Return a Wet style of an amount, with few locks."""
    api.add_style(hair, api.Wet(amount=amount, lock=0.5))
    return hair.data.vellus.styles[-1].wet


SOURCES = {
    "look": lambda hair, value: setattr(hair.data.vellus.appearance, "wetness", value),
    "style": wet,
    "dynamics": lambda hair, value: setattr(hair.data.vellus.guide_curves.vellus.dynamics, "wetness", value),
}


@pytest.mark.parametrize("source", SOURCES)
def test_each_slider_wets_look_and_motion(hair, guide_curves, source):
    dry, light = properties.look_of(hair.data.vellus), properties.dynamics_of(guide_curves.vellus)
    SOURCES[source](hair, 0.75)
    assert properties.dynamics_of(guide_curves.vellus).wetness == 0.75 and light.wetness == 0.0
    assert properties.look_of(hair.data.vellus).roughness < dry.roughness


def test_the_largest_counts(hair, guide_curves):
    for source, value in zip(SOURCES, (0.25, 0.5, 0.75), strict=True):
        SOURCES[source](hair, value)
        assert properties.dynamics_of(guide_curves.vellus).wetness == value
        assert shared_wetness.of_hair(hair.data.vellus)[1] == value
    hair.data.vellus.styles[0].wet.is_on = False
    assert shared_wetness.of_hair(hair.data.vellus) == (0.75, 0.75)


def test_guides_are_as_wet_as_the_wettest_hair(hair, guide_curves):
    bpy.context.view_layer.objects.active = bpy.data.objects["Guides"]
    bpy.ops.vellus.interpolate_hair(strand_count=50)
    wet(next(o for o in bpy.data.objects if o.name == "Hair.001"), 0.5)
    assert properties.dynamics_of(guide_curves.vellus).wetness == 0.5
    assert shared_wetness.of_hair(hair.data.vellus)[1] == 0.0


def test_settings_files_keep_what_is_set(hair, guide_curves):
    wet(hair, 0.5)
    assert api.dynamics_of(bpy.data.objects["Guides"]).wetness == api.settings_of(hair).dynamics.wetness == 0.0


def test_a_change_is_noticed_by_both(hair, guide_curves):
    guide_curves.vellus.simulates = True
    style = wet(hair, 0.5)
    bpy.context.view_layer.update()
    for source, change in (
        ("style", lambda: setattr(style, "amount", 0.6)),
        ("look", lambda: setattr(hair.data.vellus.appearance, "wetness", 0.7)),
        ("removal", lambda: style_items.remove(hair.data.vellus, 0)),
    ):
        guide_curves.vellus.is_dynamics_stale = False
        bpy.context.view_layer.objects.active = hair
        change()
        assert guide_curves.vellus.is_dynamics_stale, source
        bpy.context.view_layer.update()
    hair.data.vellus.is_shading_stale = False
    guide_curves.vellus.dynamics.wetness = 0.9
    assert hair.data.vellus.is_shading_stale


def test_the_panel_shows_the_slider_that_wets_the_hair(hair, guide_curves):
    """The panel shows the slider in effect, which is the property that the Styles panel shows, once."""
    state = guide_curves.vellus
    bpy.context.view_layer.objects.active = hair
    assert shared_wetness.slider_of(state) == (state.dynamics, "wetness")
    hair.data.vellus.appearance.wetness = 0.5
    assert shared_wetness.slider_of(state) == (hair.data.vellus.appearance, "wetness")
    style = wet(hair, 0.5)
    assert shared_wetness.slider_of(state) == (style, "amount")
    assert draw_all([panels.dynamics.VELLUS_PT_dynamics_material])["amount"] == 1


def test_keyed_rain_wets_look_shape_and_baked_motion(hair, guide_curves, tmp_path):
    """A keyed wetness of the style, as a storm in five frames, changes look, shape and baked motion."""
    scene, state = bpy.context.scene, guide_curves.vellus
    state.simulates, state.cache_folder = True, str(tmp_path)
    state.dynamics.sag_free, state.dynamics.bend_stiffness = False, 1.0
    scene.frame_start, scene.frame_end = 1, 6

    def baked():
        key = guide_baking.key_of(guide_curves, scene)
        bpy.context.view_layer.objects.active = hair
        assert bpy.ops.vellus.bake_dynamics(starts_over=True) == {"FINISHED"}
        shown = []
        for frame in (1, 6):
            scene.frame_set(frame)
            assert guide_baking.key_of(guide_curves, scene) == key  # keyed settings are no reason to bake again
            shown.append((points(bpy.data.objects["Guides"]), points(hair), properties.look_of(hair.data.vellus)))
        scene.frame_set(1)
        return shown

    dry = baked()
    style = wet(hair, 0.0)
    for frame, amount in ((1, 0.0), (6, 1.0)):
        style.amount = amount
        assert style.keyframe_insert("amount", frame=frame)
    scene.frame_set(1)
    rain = baked()
    assert rain[0][2] == dry[0][2] and rain[1][2].roughness < dry[1][2].roughness
    np.testing.assert_allclose(rain[0][1], dry[0][1], atol=1e-6)
    assert np.abs(rain[1][1] - dry[1][1]).max() > 0.05
    simulated = [frame_folders.frames_of(guide_curves).points_at(6)]
    hair.data.animation_data_clear()
    style.amount = 0.0
    baked()
    simulated.append(frame_folders.frames_of(guide_curves).points_at(6))
    assert np.abs(simulated[0] - simulated[1]).max() > 1e-3
