# SPDX-License-Identifier: GPL-3.0-or-later
"""Wet hair is shaded with the larger wetness of look and styles; its settings do not change."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.materials import materials
from hair_addon.blender.render import hair_cache
from hair_addon.blender.settings import properties, style_items
from hair_addon.core.shading import appearance
from hair_addon.core.shading.appearance import Appearance
from hair_addon.core.styling import wet


def sockets(hair):
    """Return {identifier: value} of the sockets of the material's hair node that water changes."""
    nodes = hair.data.materials[0].node_tree.nodes
    node = next(node for node in nodes if node.bl_idname == materials.HAIR_NODE)
    found = {socket.identifier: socket.default_value for socket in node.inputs}
    return [found[name] for name in ("Roughness", "Coat", "IOR", "Offset")]


def sockets_of(look):
    found = appearance.principled_sockets(look)
    return [found[name] for name in ("Roughness", "Coat", "IOR", "Offset")]


@pytest.mark.parametrize(
    "wetness, amounts, wanted", [(0, [], 0), (0.5, [], 0.5), (0.25, [1, 0.5], 1), (0.75, [0.5], 0.75)]
)
@pytest.mark.parametrize("model", ["KAJIYA_KAY", "MARSCHNER"])
def test_the_wetter_of_look_and_style_is_seen(hair, wetness, amounts, wanted, model):
    state = hair.data.vellus
    state.model, state.appearance.wetness, state.marschner.size = model, wetness, 32
    style_items.assign(state, [wet.Settings(amount=amount, lock=0.5, seed=seed) for seed, amount in enumerate(amounts)])
    bpy.context.view_layer.update()
    soaked = appearance.wetted(Appearance(), wanted)
    assert properties.look_of(state) == soaked
    np.testing.assert_allclose(sockets(hair), sockets_of(soaked), rtol=1e-6)
    shown = hair_cache.shading_of(hair.data)
    state.appearance.wetness = wanted
    style_items.assign(state, [])
    assert hair_cache.shading_of(hair.data) is shown  # the same tables, made once
    assert api.settings_of(hair).appearance == Appearance(wetness=wanted)


def test_the_flat_color_darkens_with_the_style(hair):
    """The material's viewport color, which EEVEE and Blender's viewport show, darkens with the style's wetness."""
    state, colors = hair.data.vellus, []
    style_items.assign(state, [wet.Settings(amount=0.0, lock=0.5)])
    for amount in (0.0, 0.5, 1.0):
        state.styles[0].wet.amount = amount
        bpy.context.view_layer.update()
        material = hair.data.materials[0]
        node = next(node for node in material.node_tree.nodes if node.bl_idname == materials.HAIR_NODE)
        color = next(socket for socket in node.inputs if socket.identifier == "Color").default_value
        np.testing.assert_array_equal(color, material.diffuse_color)
        colors.append(color[:3])
    np.testing.assert_allclose(colors[0], appearance.mean_color(Appearance()), rtol=1e-6)
    assert (np.diff(colors, axis=0) < 0.0).all() and (np.array(colors[-1]) < 0.9 * np.array(colors[0])).all()


def test_a_style_that_is_off_is_dry(hair):
    state = hair.data.vellus
    style_items.assign(state, [wet.Settings(lock=0.5)])
    bpy.context.view_layer.update()
    np.testing.assert_allclose(sockets(hair), sockets_of(Appearance(wetness=1.0)), rtol=1e-6)
    state.styles[0].wet.is_on = False
    bpy.context.view_layer.update()
    np.testing.assert_allclose(sockets(hair), sockets_of(Appearance()), rtol=1e-6)


def test_keyed_water_is_seen_in_each_frame(hair):
    state = hair.data.vellus
    style_items.assign(state, [wet.Settings(lock=0.5)])
    for frame, amount in ((1, 0.0), (11, 1.0)):
        state.styles[0].wet.amount = amount
        hair.data.keyframe_insert("vellus.styles[0].wet.amount", frame=frame)
    for curve in hair.data.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    for frame in (1, 6, 11, 1):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(sockets(hair), sockets_of(Appearance(wetness=(frame - 1) / 10)), rtol=1e-5)


def test_hair_that_shares_a_material_and_is_wetter_gets_its_own(hair):
    copy = hair.copy()
    copy.data = hair.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    assert copy.data.materials[0] == hair.data.materials[0]
    style_items.assign(copy.data.vellus, [wet.Settings(amount=0.5, lock=0.5)])
    bpy.context.view_layer.update()
    np.testing.assert_allclose(sockets(copy), sockets_of(Appearance(wetness=0.5)), rtol=1e-6)
    np.testing.assert_allclose(sockets(hair), sockets_of(Appearance()), rtol=1e-6)


def test_a_look_is_saved_as_it_is_set(hair):
    api.shade(hair, "BLOND", wetness=0.5)
    api.add_style(hair, "WET", fit=True)
    assert api.settings_of(hair).appearance.wetness == 0.5
    api.shade(hair, roughness=0.5)
    assert api.settings_of(hair).appearance.roughness == 0.5 and properties.look_of(hair.data.vellus).roughness == 0.14
    assert api.table_settings(replace(api.settings_of(hair), appearance=Appearance(wetness=1.0))).eta == 1.38
