# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of the simulation give each guide its own bend stiffness, damping, hold and pinned length."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.blender.host import running
from hair_addon.blender.live import dynamics_state, invalidation, live_hair, simulated_hair
from hair_addon.core.dynamics.rod import material
from hair_addon.core.dynamics.rod.settings import VARIED, DynamicsSettings
from hair_addon.core.errors import HairError
from hair_addon.core.long_work import run_now
from tests.support.commands import run_here
from tests.support.dynamics.swung import simulate_apart

SETTING = "dynamics.bend_stiffness"
LAST = 5

# {setting: (value at From, value at To)}
VALUES = {"bend_stiffness": (1.0, 500.0), "damping": (0.0, 0.25), "hold": (0.0, 500.0), "pinned": (0.0, 0.5)}


@pytest.fixture
def swung(hair, tmp_path):
    """Return guides that swing without touching each other, and hair of these guides."""
    return simulate_apart(tmp_path).data, hair.data


@pytest.fixture
def played(swung, monkeypatch):
    """Return guides and hair that simulate while they play, as in a window."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    yield swung
    live_hair.cancel_writing()
    invalidation.clear()


def baked(guides):
    """Return (G, P, 3) of the last frame of a new bake."""
    run_now(guide_baking.baking([guides], LAST, bpy.context.scene, True))
    return frame_folders.frames_of(guides).points_at(LAST)


def play(first, last):
    for frame in range(first, last + 1):
        bpy.context.scene.frame_set(frame)


def half_group():
    """Return the name of a vertex group with weight 1 where x > 0, and 0 elsewhere."""
    sphere = bpy.data.objects["Sphere"]
    group = sphere.vertex_groups.new(name="half")
    group.add([v.index for v in sphere.data.vertices if v.co.x > 0.0], 1.0, "REPLACE")
    bpy.context.view_layer.update()
    return group.name


@pytest.mark.parametrize("name", VALUES)
def test_each_half_moves_with_its_value(swung, name):
    """Guides where the map is 0 and 1 move like guides with the value of From and To everywhere."""
    assert VALUES.keys() == VARIED.keys()
    guides, hair = swung
    low, high = VALUES[name]
    setattr(guides.vellus.dynamics, name, low)
    of_low = baked(guides)
    setattr(guides.vellus.dynamics, name, high)
    of_high = baked(guides)
    x = np.array([curve.points[0].position.x for curve in guides.curves])
    api.set_map(hair, f"dynamics.{name}", f"group:{half_group()}", low=low / high, high=1.0)
    found = baked(guides)
    tolerance = 1e-5 if name == "pinned" else 0.0
    np.testing.assert_allclose(found[x > 0.25], of_high[x > 0.25], rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(found[x < -0.25], of_low[x < -0.25], rtol=0.0, atol=tolerance)
    assert np.abs(of_high - of_low).max(axis=(1, 2)).min() > 1e-4
    assert [one.setting for one in api.maps_of(hair)] == [f"dynamics.{name}"]


@pytest.mark.parametrize("name", VALUES)
def test_a_constant_map_is_the_value(swung, name):
    """A constant map keeps the bits of the value; its factor multiplies the value; frames are outdated by a map."""
    guides, hair = swung
    value = VALUES[name][1]
    setattr(guides.vellus.dynamics, name, value)
    whole, key = baked(guides), guide_baking.key_of(guides, bpy.context.scene)
    api.set_map(hair, f"dynamics.{name}", "strand", low=1.0, high=1.0)
    assert guide_baking.key_of(guides, bpy.context.scene) != key
    np.testing.assert_array_equal(baked(guides), whole)
    api.set_map(hair, f"dynamics.{name}", "strand", low=0.5, high=0.5)
    half = baked(guides)
    api.clear_map(hair, f"dynamics.{name}")
    assert guide_baking.key_of(guides, bpy.context.scene) == key
    setattr(guides.vellus.dynamics, name, 0.5 * value)
    np.testing.assert_array_equal(baked(guides), half)


@pytest.mark.parametrize(("source", "message"), [("group:lost", '"lost"'), ("clump", "Maps of guides")])
def test_a_map_without_values_is_a_status(swung, tmp_path, source, message):
    """A setting keeps its value, with a status, if its map has no source or a kind that guides do not have."""
    guides, hair = swung
    value = baked(guides)
    api.set_map(hair, SETTING, source, low=100.0, high=100.0)
    bpy.context.view_layer.update()
    assert message in guides.vellus.dynamics_status
    np.testing.assert_array_equal(baked(guides), value)
    play(1, 3)
    assert message in guides.vellus.dynamics_status
    path = tmp_path / "swung.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    ended = run_here("simulate", path, "--last-frame", 2, "--overwrite")
    assert ended.status == 0 and message in ended.errors
    guides, hair = bpy.data.hair_curves["Guides"], bpy.data.hair_curves["Hair"]
    api.clear_map(hair, SETTING)
    bpy.context.view_layer.update()
    assert guides.vellus.dynamics_status == ""


def test_a_map_without_values_does_not_stop_playing(played):
    """While a source is missing, playback simulates with the setting's value; it continues when the source is back."""
    guides, hair = played
    play(1, 3)
    before = simulated_hair.played_cache.get(guides.session_uid).frames[3]
    api.set_map(hair, SETTING, "group:lost", low=100.0, high=100.0)
    bpy.context.view_layer.update()
    play(1, 3)
    assert '"lost"' in guides.vellus.dynamics_status
    np.testing.assert_array_equal(simulated_hair.played_cache.get(guides.session_uid).frames[3], before)
    bpy.data.objects["Sphere"].vertex_groups.new(name="lost")
    bpy.data.objects["Sphere"].data.update_tag()
    bpy.context.view_layer.update()
    assert guides.vellus.dynamics_status == ""
    play(1, 3)
    assert np.abs(simulated_hair.played_cache.get(guides.session_uid).frames[3] - before).max() > 1e-4


def test_a_map_that_changes_during_playback_outdates_earlier_frames(played):
    """A new map, or painted weights of a map, make earlier frames outdated."""
    guides, hair = played
    name = half_group()
    play(1, 3)
    api.set_map(hair, SETTING, f"group:{name}", low=0.1)
    bpy.context.view_layer.update()
    play(4, 5)
    sentence, values = dynamics_state.state_of(guides)
    assert "with other settings" in sentence and values["frame"] == 3
    play(1, 5)
    assert "with other settings" not in dynamics_state.state_of(guides)[0]
    sphere = bpy.data.objects["Sphere"]
    sphere.vertex_groups[name].add(range(len(sphere.data.vertices)), 0.5, "REPLACE")
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    play(6, 7)
    sentence, values = dynamics_state.state_of(guides)
    assert "with other settings" in sentence and values["frame"] == 5


def test_a_map_outdates_baked_frames(swung):
    """A new map and painted weights make baked frames outdated; a new bake is up to date."""
    guides, hair = swung
    name, sphere = half_group(), bpy.data.objects["Sphere"]
    baked(guides)
    bpy.context.view_layer.update()
    as_baked = "Frames {first} to {last} are baked"
    assert dynamics_state.state_of(guides)[0] == as_baked
    api.set_map(hair, SETTING, f"group:{name}", low=0.1)
    bpy.context.view_layer.update()
    assert "with other settings" in dynamics_state.state_of(guides)[0]
    baked(guides)
    bpy.context.view_layer.update()
    assert dynamics_state.state_of(guides)[0] == as_baked
    sphere.vertex_groups[name].add(range(len(sphere.data.vertices)), 0.5, "REPLACE")
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    assert "with other settings" in dynamics_state.state_of(guides)[0]


def test_stiffness_of_another_number_of_strands_is_an_error():
    """A stiffness for each strand needs one value per strand."""
    lengths = np.full((3, 8), 0.01)
    with pytest.raises(HairError, match="stiffnesses"):
        material.material_of(DynamicsSettings(), lengths, stiffness=np.ones(2))


def test_a_mask_of_wetness_that_changes_during_playback_outdates_earlier_frames(played):
    """A new mask of *Wet* and its painted weights make played and baked frames outdated; equal weights do not."""
    guides, hair = played
    name, sphere = half_group(), bpy.data.objects["Sphere"]
    api.add_style(hair, "WET", amount=0.8)
    play(1, 3)
    hair.vellus.styles[0].wet.mask = name
    bpy.context.view_layer.update()
    play(4, 5)
    sentence, values = dynamics_state.state_of(guides)
    assert "with other settings" in sentence and values["frame"] == 3
    play(1, 5)
    for weight, is_outdated in ((0.4, True), (0.4, False)):
        play(1, 5)
        sphere.vertex_groups[name].add(range(len(sphere.data.vertices)), weight, "REPLACE")
        sphere.data.update_tag()
        bpy.context.view_layer.update()
        play(6, 7)
        assert ("with other settings" in dynamics_state.state_of(guides)[0]) == is_outdated
    baked(guides)
    bpy.context.view_layer.update()
    assert dynamics_state.state_of(guides)[0] == "Frames {first} to {last} are baked"
    sphere.vertex_groups[name].add(range(len(sphere.data.vertices)), 0.9, "REPLACE")
    sphere.data.update_tag()
    bpy.context.view_layer.update()
    assert "with other settings" in dynamics_state.state_of(guides)[0]
