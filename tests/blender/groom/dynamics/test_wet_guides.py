# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides have the wetness of the Wet style's mask at their roots."""

import bpy
import numpy as np
import pytest

from hair_addon import api
from hair_addon.blender.groom.dynamics import frame_folders, guide_baking, guide_draping
from hair_addon.blender.live import dynamics_state
from hair_addon.core.grooming.guide_tool_settings import DrapeSettings
from hair_addon.core.long_work import run_now
from tests.support.dynamics.swung import simulate_apart
from tests.support.reading import points, write_points

LAST = 6


@pytest.fixture
def swung(hair, tmp_path):
    """Return guides that swing without touching each other."""
    return simulate_apart(tmp_path)


def paint(weight):
    """Give the vertices of the sphere with x > 0 a weight in the group of the mask."""
    sphere = bpy.data.objects["Sphere"]
    group = sphere.vertex_groups.get("rain") or sphere.vertex_groups.new(name="rain")
    group.add([v.index for v in sphere.data.vertices if v.co.x > 0.0], weight, "REPLACE")
    bpy.context.view_layer.update()


def baked(guides, last=LAST, starts_over=True):
    run_now(guide_baking.baking([guides.data], last, bpy.context.scene, starts_over))
    return frame_folders.frames_of(guides.data).points_at(last)


def sides(guides):
    """Return two (G,) bool arrays: guides rooted well inside the weighted side, and guides rooted well outside of
    it.
    """
    x = np.array([curve.points[0].position.x for curve in guides.data.curves])
    return x > 0.25, x < -0.25


def test_guides_are_wet_where_the_mask_is(hair, swung):
    wet_side, dry_side = sides(swung)
    dry = baked(swung)
    api.add_style(hair, api.Wet(lock=0.4))
    wet = baked(swung)
    paint(1.0)
    hair.data.vellus.styles[0].wet.mask = "rain"
    there = baked(swung)
    np.testing.assert_array_equal(there[wet_side], wet[wet_side])
    np.testing.assert_array_equal(there[dry_side], dry[dry_side])
    assert np.abs(wet - dry).max(axis=(1, 2))[dry_side].min() > 1e-4
    hair.data.vellus.styles[0].wet.invert_mask = True
    np.testing.assert_array_equal(baked(swung)[dry_side], wet[dry_side])
    swung.data.vellus.dynamics.wetness = 1.0  # of all
    np.testing.assert_array_equal(baked(swung), wet)


def test_changed_guides_with_baked_frames_are_noted_without_another_update(hair, swung):
    """Wet guides that grow again after a bake are updated once: updates within updates would not end."""
    paint(1.0)
    api.add_style(hair, api.Wet(lock=0.4, mask="rain"))
    baked(swung, 2)
    depth, most = [0], [0]

    def begin(*_):
        depth[0] += 1
        most[0] = max(most[0], depth[0])

    def end(*_):
        depth[0] -= 1

    handlers = bpy.app.handlers.depsgraph_update_post
    handlers.insert(0, begin)
    handlers.append(end)
    try:
        swung.data.vellus.guides.length = 0.3
        bpy.context.view_layer.update()
    finally:
        handlers.remove(begin)
        handlers.remove(end)
    assert "bake again" in dynamics_state.state_of(swung.data)[0] and depth == [0] and most == [1]


def test_guides_are_as_wet_as_their_strands_on_the_mean(hair, swung):
    """Guides have the mean wetness of their strands, with varied wetness, masks and keyframes."""
    wet_side, dry_side = sides(swung)
    swung.data.vellus.dynamics.wetness = 0.5
    half = baked(swung)
    swung.data.vellus.dynamics.wetness = 0.0
    dry = baked(swung)
    api.add_style(hair, api.Wet(lock=0.4, vary=1.0))
    np.testing.assert_array_equal(baked(swung), half)
    paint(1.0)
    style = hair.data.vellus.styles[0].wet
    style.mask = "rain"
    there = baked(swung)
    np.testing.assert_array_equal(there[wet_side], half[wet_side])
    np.testing.assert_array_equal(there[dry_side], dry[dry_side])
    key = guide_baking.key_of(swung.data, bpy.context.scene)
    style.vary = 0.5
    assert guide_baking.key_of(swung.data, bpy.context.scene) != key
    style.keyframe_insert("vary", frame=1)
    keyed = guide_baking.key_of(swung.data, bpy.context.scene)
    style.vary = 1.0
    assert guide_baking.key_of(swung.data, bpy.context.scene) == keyed


def test_draped_guides_are_as_wet_as_the_mask_says(hair, swung):
    """Draped guides have the wetness of the mask, so wet guides sink lower."""
    wet_side, dry_side = sides(swung)

    def draped():
        before = points(swung)
        guide_draping.drape(swung.data, DrapeSettings(seconds=0.5), bpy.context.evaluated_depsgraph_get())
        found = points(swung)
        write_points(swung, before)
        return found

    dry = draped()
    api.add_style(hair, api.Wet(lock=0.4))
    wet = draped()
    paint(1.0)
    hair.data.vellus.styles[0].wet.mask = "rain"
    there = draped()
    np.testing.assert_array_equal(there[wet_side], wet[wet_side])
    np.testing.assert_array_equal(there[dry_side], dry[dry_side])
    assert np.abs(wet - dry).max(axis=(1, 2))[dry_side].min() > 1e-5


def test_baked_frames_follow_from_the_mask(hair, swung):
    """A changed mask outdates baked frames, also with an animated amount or if it belongs to a weaker style."""
    scene = bpy.context.scene
    paint(1.0)
    api.add_style(hair, api.Wet(lock=0.4, mask="rain"))
    first = guide_baking.key_of(swung.data, scene)
    paint(0.5)
    painted = guide_baking.key_of(swung.data, scene)
    api.add_style(hair, api.Wet(lock=0.4, mask="rain", amount=0.2, invert_mask=True))
    lesser = guide_baking.key_of(swung.data, scene)
    assert len({tuple(sorted(key.items())) for key in (first, painted, lesser)}) == 3
    style = hair.data.vellus.styles[1].wet
    for frame, amount in ((1, 0.0), (LAST, 0.6)):
        style.amount = amount
        style.keyframe_insert("amount", frame=frame)
    scene.frame_set(1)
    keyed = guide_baking.key_of(swung.data, scene)
    scene.frame_set(LAST)
    assert guide_baking.key_of(swung.data, scene) == keyed
    scene.frame_set(1)
    before = baked(swung)
    hair.data.animation_data_clear()
    style.amount = 0.0
    assert np.abs(baked(swung) - before).max() > 1e-4


def test_baking_goes_on_to_the_same_bits_with_keyed_weight(hair, swung):
    """Resumed baking gives the same bits with a keyed weight, as stored states include the keyed material and
    wetness.
    """
    dynamics = swung.data.vellus.dynamics
    for frame, weight in ((1, 1.0), (20, 4.0)):
        dynamics.weight = weight
        dynamics.keyframe_insert("weight", frame=frame)
    paint(1.0)
    api.add_style(hair, api.Wet(lock=0.4, mask="rain"))
    bpy.context.scene.frame_set(1)
    whole = baked(swung, 30)
    folder = frame_folders.folder_of(swung.data)
    for frame in range(26, 32):
        (folder / f"+{frame:08d}.npz").unlink()
    (folder / "state_+00000031.npz").unlink()
    np.testing.assert_array_equal(baked(swung, 30, starts_over=False), whole)
