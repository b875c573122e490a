# SPDX-License-Identifier: GPL-3.0-or-later
"""Delivered hair: where live hair is, in a Blender without the add-on; taken off again, all is as before."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data import delivered_hair, follow_nodes
from hair_addon.blender.groom import guide_baking
from hair_addon.blender.io import delivery
from hair_addon.core.errors import HairError
from hair_addon.core.long_work import Stopped, run_now
from tests.support.delivered import without_addon
from tests.support.following import grow
from tests.support.reading import evaluated_points, everything
from tests.support.swung import simulate

LAST = 7


@pytest.fixture
def shot(arm, tmp_path):
    """A saved file of hair on an arm that bends, moves and blurs, whose guides are baked; its guides."""
    arm.location.x = 1.0
    arm.keyframe_insert("location", frame=1)
    arm.location.x = 3.0
    arm.keyframe_insert("location", frame=11)
    guides, hair = grow(arm, guide_count=20, strand_count=60)
    assert hair.name == "Hair"
    simulate(guides, tmp_path / "frames")
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, LAST
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.5
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    run_now(guide_baking.baking([guides.data], LAST, scene))
    return guides.data


def deliver(guides):
    return run_now(delivery.delivering(guides, delivery.path_of(guides), bpy.context.scene))


def live(times):
    scene, found = bpy.context.scene, {}
    for time in times:
        scene.frame_set(int(time // 1), subframe=time % 1)
        found[time] = evaluated_points(bpy.data.objects["Hair"]).reshape(-1, 3)
    return found


def largest_difference(some, others):
    return max(abs(some[time] - others[time]).max() for time in some)


def test_a_blender_without_the_addon_has_the_same_hair(shot, tmp_path):
    times = (0.75, 1.0, 1.25, 4.0, 4.75, LAST, LAST + 0.25)
    before = live(times)
    made = deliver(shot)
    assert made.path == tmp_path / "shot_Guides.usdc" and made.byte_count == made.path.stat().st_size
    assert largest_difference(live(times), before) < 1e-6
    assert largest_difference({time: before[4.0] for time in times}, before) > 0.01
    bpy.ops.wm.save_mainfile()
    assert largest_difference(without_addon(tmp_path / "shot.blend", tmp_path, times), before) < 1e-6
