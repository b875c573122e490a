# SPDX-License-Identifier: GPL-3.0-or-later
"""Viewports with Light Grid have the light of renders, keep it while the view turns, and reduce it when its causes
change.
"""

import itertools
from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.data import scene as scene_data
from hair_addon.blender.data.pictures import light_panoramas
from hair_addon.blender.render import drawn_scene, light_paths
from hair_addon.blender.render.viewport import hair_picture, live_light
from hair_addon.core.long_work import Stopped
from hair_addon.core.shading.light_paths import gather, light_texels
from tests.blender.render.test_light_paths import BROWN, hair_of, light

SIZE, PATHS = 48, 6_000
BLOND = replace(BROWN, melanin=0.15)
TIMES = itertools.count(0.0, 10.0)  # [s] of redraws, each long after the last


@pytest.fixture
def view(scene, rng, monkeypatch):
    """Return (camera, function that reads the scene as a viewport does) of blond hair in a lamp and a world.

    Voxels may stay noisy, so that few paths suffice.
    """
    monkeypatch.setattr(light_paths, "NOISE", np.inf)
    hair_of(scene, rng.uniform(-0.3, 0.3, (600, 3)), BLOND, radius=0.006)
    light(scene, world=0.1, sun=4.0)

    def read():
        bpy.context.view_layer.update()
        return drawn_scene.read(scene, bpy.context.view_layer, bpy.context.evaluated_depsgraph_get())

    bpy.context.view_layer.update()
    yield scene_data.read_camera(scene, bpy.context.evaluated_depsgraph_get(), SIZE, SIZE), read
    live_light.end()


def at_rest(live, drawn, camera, paths=PATHS):
    """Return the scene once all paths are traced."""
    for _share in range(100):
        found = redrawn(live, drawn, camera, paths=paths)
        live.wait()
        if live.is_done:
            return found
    raise AssertionError("paths are followed without an end")


def redrawn(live, drawn, camera, may_follow=True, paths=PATHS):
    return live.lit(drawn, camera, paths, next(TIMES), may_follow)


def picture_of(drawn, camera):
    picture = hair_picture.HairPicture((SIZE, SIZE), 2)
    for _ in range(4):
        picture.add_pass(drawn, *camera)
    return picture.read()[..., :3]


def part_of(drawn):
    """Return the part of dual scattering that paths replace in a scene."""
    return float(drawn.lights["grid_corner"][3])


def blocks(picture):
    return picture.reshape(4, SIZE // 4, 4, SIZE // 4, 3).mean(axis=(1, 3))


def turned(camera, degrees):
    """Return a camera that has turned around the hair."""
    angle = np.radians(degrees)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return camera[0] @ turn, camera[1]


def test_at_rest_the_light_is_that_of_renders(view, fine_shadows):
    """At rest the light of blocks of pixels equals that of renders within 3 % of the mean, with enough paths for a
    noise of 2 %.

    Dual scattering differs by more.
    """
    camera, read = view
    drawn, paths = read(), 20 * PATHS
    found = at_rest(live_light.LiveLight(), drawn, camera, paths)
    live, render, dual = (
        blocks(picture_of(one, camera)) for one in (found, light_paths.with_grid(drawn, *camera, paths, seed=1), drawn)
    )
    scale = render.mean()
    assert np.abs(live - render).mean() < 0.03 * scale
    assert np.abs(dual - render).mean() > 0.06 * scale


def test_paths_are_added_at_rest_while_voxels_are_noisy(view, monkeypatch):
    """At rest, noisy voxels get more paths than a picture has, up to a maximum."""
    monkeypatch.setattr(gather, "_KNOWN", 1.0)
    monkeypatch.setattr(light_paths, "NOISE", 1e-3)
    monkeypatch.setattr(light_paths, "_MOST_TIMES", 3)
    camera, read = view
    live = live_light.LiveLight()
    at_rest(live, read(), camera)
    most = light_paths.most_paths(live._paths.grid.device, live._goal)
    assert live.is_slow and most > 2 * live._goal and most <= live._paths.taken < 2.0 * most


def test_a_gpu_traces_as_many_paths_for_small_pictures_as_for_large_ones():
    """Fewer paths take a GPU as long, so small pictures, or hair in a small part of them, would only get noisier."""
    live = live_light.LiveLight()
    for is_cpu, shares, most in ((True, [1250, 16_384], 80_000), (False, [16_384, 16_384], 2_400_000)):
        live._goal = 20_000
        live._paths = SimpleNamespace(grid=SimpleNamespace(device=SimpleNamespace(is_cpu=is_cpu)))
        assert [live._share_of(count) for count in (20_000, 300_000)] == shares
        assert live._most == most


def test_the_picture_goes_over_to_paths_in_steps(view):
    """The part of the light that paths replace grows by at most a quarter per redraw."""
    camera, read = view
    drawn, live = read(), live_light.LiveLight()
    parts = [0.0]
    while not live.is_done:
        parts.append(part_of(redrawn(live, drawn, camera)))
        live.wait()
    assert parts[-1] == 1.0 and 0.0 <= np.diff(parts).min() and np.diff(parts).max() <= 0.25


def test_a_view_that_turns_keeps_the_light(view):
    """The first redraw of another view shows the light of paths, and more paths are added to it."""
    camera, read = view
    drawn, live = read(), live_light.LiveLight()
    found = at_rest(live, drawn, camera)
    there = turned(camera, 15.0)
    assert redrawn(live, drawn, there) is found
    before = live._paths.taken
    redrawn(live, drawn, there)
    live.wait()
    assert 0.5 * before < live._paths.taken < before + PATHS


def test_no_frame_jumps_in_brightness_while_the_view_turns_and_comes_to_rest(view):
    """Over a turn by 90 degrees and the rest after it, the mean level changes by at most 5 % from frame to frame.

    The first redraw after the last motion is as bright as the last frame of the motion, and the final light is the
    light of paths in the new view alone.
    """
    camera, read = view
    drawn, live = read(), live_light.LiveLight()
    found = at_rest(live, drawn, camera)
    for angle in range(0, 91, 15):
        there = turned(camera, float(angle))
        assert redrawn(live, drawn, there, may_follow=False) is found
    levels = []
    while not live.is_done:
        levels.append(picture_of(redrawn(live, drawn, there), there).mean())
        live.wait()
    levels.append(picture_of(redrawn(live, drawn, there), there).mean())
    assert levels[0] == picture_of(found, there).mean() and len(levels) > 5
    assert np.abs(np.diff(levels) / levels[1:]).max() < 0.05
    alone = picture_of(at_rest(live_light.LiveLight(), drawn, there), there).mean()
    assert levels[-1] == pytest.approx(alone, rel=0.04)


def test_hair_that_changes_just_before_the_view_turns_has_its_own_light(view, monkeypatch):
    """A view that turns before any path of changed hair is followed shows no light of the hair before the change."""
    camera, read = view
    live = live_light.LiveLight()
    at_rest(live, read(), camera)
    position = bpy.data.hair_curves[0].attributes["position"].data
    points = np.empty(3 * len(position), np.float32)
    position.foreach_get("vector", points)
    position.foreach_set("vector", 1.7 * points)
    bpy.data.hair_curves[0].update_tag()
    changed = read()
    with monkeypatch.context() as patched:
        patched.setattr(gather.PathSums, "follow", stopped)
        redrawn(live, changed, camera)
        redrawn(live, changed, camera)
        live.wait()
    found = at_rest(live, changed, turned(camera, 20.0))
    assert part_of(found) == 1.0


def stopped(*_given):
    raise Stopped


def test_changed_lights_are_forgotten(view):
    """A lamp that is turned off leaves nothing of its light; one that dims a little leaves most."""
    camera, read = view
    live = live_light.LiveLight()
    at_rest(live, read(), camera)
    lamp = bpy.data.lights["Sun"]
    parts = []
    for energy in (3.9, 0.0):
        lamp.energy = energy
        parts.append(part_of(redrawn(live, read(), camera, may_follow=False)))
    assert parts[0] > 0.75 and parts[1] < 0.1
    found = at_rest(live, read(), camera)
    expected = light_paths.with_grid(read(), *camera, 4 * PATHS)
    found, expected = (blocks(picture_of(one, camera)) for one in (found, expected))
    assert np.abs(found - expected).mean() < 0.04 * expected.mean()


def test_the_light_of_a_pattern_that_turns_is_forgotten(view, monkeypatch):
    """A lamp that lights the other half of the hair, and sends as much light, leaves little of its former light."""
    half = np.zeros((32, 64, 3))
    half[:, 16:48] = 1.0  # along the lamp's x axis
    panorama = light_panoramas.Panorama(half, np.ones((32, 64)))
    monkeypatch.setattr(light_panoramas, "find", lambda light, *_given: panorama if light.type == "POINT" else None)
    lamp = bpy.data.objects["Sun"]
    lamp.data.type, lamp.data.energy, lamp.location, lamp.rotation_euler = "POINT", 300.0, (0.0, -3.0, 0.0), (0, 0, 0)
    camera, read = view
    live = live_light.LiveLight()
    assert part_of(at_rest(live, read(), camera)) > 0.9
    lamp.rotation_euler = (0.0, np.pi, 0.0)
    assert part_of(redrawn(live, read(), camera, may_follow=False)) < 0.1


def test_light_moves_with_its_hair(view):
    """Light moves with its hair. After a change of Strand Count, only the light of voxels is shown."""
    camera, read = view
    live = live_light.LiveLight()
    before = at_rest(live, read(), camera)
    assert before.hair_visibility[0]["light_grid"] is live._textures[0]
    assert len(live._texels[0]) > light_texels.sides_of(live._grid.shape)[2]
    bpy.data.objects["Hair"].location.x = 0.25
    after = redrawn(live, read(), camera)
    moved = after.lights["grid_corner"] - before.lights["grid_corner"]
    np.testing.assert_allclose(moved, [0.25, 0.0, 0.0, 0.0], atol=1e-5)
    assert after.hair_visibility[0]["light_grid"] is live._textures[0]
    bpy.data.hair_curves["Hair"].remove_curves(indices=list(range(100)))
    fewer = redrawn(live, read(), camera, may_follow=False)
    assert 0.0 < part_of(fewer) < 1.0
    assert fewer.hair_visibility[0]["light_grid"] is live._of_voxels[0]


@pytest.fixture
def region(view, monkeypatch):
    """Return a context with a region that Blender draws, and with timers that only count."""
    timers = set()
    monkeypatch.setattr(live_light.running, "has_window", lambda: True)
    timing = SimpleNamespace(
        is_registered=timers.__contains__,
        register=lambda timer, **_options: timers.add(timer),
        unregister=timers.discard,
    )
    monkeypatch.setattr(live_light, "bpy", SimpleNamespace(app=SimpleNamespace(timers=timing), context=bpy.context))
    monkeypatch.setattr(live_light, "_REST", -1.0)
    bpy.context.scene.vellus.multiple_scattering = "GRID"
    place = SimpleNamespace(width=SIZE, height=SIZE, as_pointer=lambda: 7)
    return SimpleNamespace(region=place, scene=bpy.context.scene), timers


def test_nothing_is_followed_for_a_region_that_is_not_drawn(view, region, monkeypatch):
    """No paths are traced for a region that is not drawn: each share needs a redraw, which is requested for a while
    only.
    """
    camera, read = view
    context, _timers = region
    followed = []
    real = gather.PathSums.follow
    monkeypatch.setattr(gather.PathSums, "follow", lambda *given: (followed.append(1), real(*given)))
    live_light.lit(context, read(), camera)
    (live,) = live_light.light_cache.values()
    live.wait()
    ticks = 0
    while live_light._wake() is not None:
        ticks += 1
        assert ticks < 100
    assert len(followed) == 1 and not live.is_busy


def test_a_share_waits_while_viewports_are_redrawn(view, region, monkeypatch):
    """A share waits while viewports are redrawn, and continues once no viewport was redrawn between two checks."""
    camera, read = view
    context, _timers = region
    waits = []

    def wait(rest):
        for _ in range(2):
            waits.append((rest.is_on, live.traced))
            if not rest.is_on:
                live_light._wake()

    live = SimpleNamespace(traced=0)
    real = gather._traced

    def traced(*given):
        live.traced += 1
        return real(*given)

    monkeypatch.setattr(live_light, "_SHARES", 1_000)
    monkeypatch.setattr(gather, "_traced", traced)
    monkeypatch.setattr(live_light._Rest, "wait", wait)
    drawn = read()
    live_light.lit(context, drawn, camera)
    (found,) = live_light.light_cache.values()
    found._job.result()
    assert waits[:3] == [(False, 0), (False, 0), (True, 0)] and live.traced == 1


def test_a_region_that_waits_for_another_is_not_redrawn(view, region, monkeypatch):
    """A region that waits for another region's share is not redrawn, as a redraw would interrupt the share."""
    camera, read = view
    context, _timers = region
    asked = []
    drawn = read()
    other = SimpleNamespace(width=SIZE, height=SIZE, as_pointer=lambda: 8, tag_redraw=lambda: asked.append(8))
    place = SimpleNamespace(width=SIZE, height=SIZE, as_pointer=lambda: 7, tag_redraw=lambda: asked.append(7))
    window = SimpleNamespace(screen=SimpleNamespace(areas=[SimpleNamespace(type="VIEW_3D", regions=[place, other])]))
    manager = SimpleNamespace(windows=[window])
    monkeypatch.setattr(live_light.bpy, "context", SimpleNamespace(window_manager=manager))
    light_there, light_here = (
        live_light.lit(SimpleNamespace(region=one, scene=context.scene), drawn, camera) for one in (place, other)
    )
    assert light_there is light_here is drawn
    live_light._wake()
    assert not live_light._rest.is_on and asked == []
    for live in live_light.light_cache.values():
        live.wait()
    live_light._wake()
    assert asked == [7, 8]


def test_a_picture_is_refined_once_its_light_is_known(view, region, monkeypatch):
    """A picture is refined once it has its paths; until then it restarts with each share and has few passes."""
    camera, read = view
    context, _timers = region
    monkeypatch.setattr(live_light, "_SHARES", 2)
    drawn = read()
    asked, live = [], None
    while live is None or not live.is_done:
        live_light.lit(context, drawn, camera)
        (live,) = live_light.light_cache.values()
        asked.append([live_light.is_next(context, passes) for passes in (0, 32)])
        live.wait()
    live_light.lit(context, drawn, camera)
    assert asked[0] == [False, True] and not live_light.is_next(context, 32)


@pytest.mark.parametrize("way", ["dual", "preference", "solid"])
def test_nothing_is_followed_where_it_is_not_wanted(view, region, monkeypatch, way):
    camera, read = view
    drawn = read()
    context, _timers = region
    if way == "dual":
        context.scene.vellus.multiple_scattering = "DUAL"
    elif way == "preference":
        monkeypatch.setattr(live_light.preferences, "has_live_light", lambda: False)
    else:
        drawn = replace(drawn, light=replace(drawn.light, kind="STUDIO"))
    assert live_light.lit(context, drawn, camera) is drawn
    assert not len(live_light.light_cache)


def test_no_timer_and_no_light_are_left_after_unregistering(view, region):
    camera, read = view
    context, timers = region
    live_light.lit(context, read(), camera)
    (live,) = live_light.light_cache.values()
    assert live.is_waiting and timers
    live_light.unregister()
    assert not timers and not live.is_busy and not len(live_light.light_cache)


def test_a_setting_without_effect_says_so(view, region, monkeypatch):
    """A message says why Light Grid has no effect: it is off in the preferences, or the hair has another model."""
    camera, read = view
    context, _timers = region
    live_light.lit(context, read(), camera)
    assert live_light.obstacles(context.scene) == []
    api.shade(bpy.data.objects["Hair"].data, BLOND, model="KAJIYA_KAY")
    drawn = read()
    assert live_light.lit(context, drawn, camera) is drawn
    (sentence,) = live_light.obstacles(context.scene)
    assert "Marschner" in sentence
    monkeypatch.setattr(live_light.preferences, "has_live_light", lambda: False)
    (sentence,) = live_light.obstacles(context.scene)
    assert "preferences" in sentence
    context.scene.vellus.multiple_scattering = "DUAL"
    assert live_light.obstacles(context.scene) == []
