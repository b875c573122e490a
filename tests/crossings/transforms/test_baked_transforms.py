# SPDX-License-Identifier: GPL-3.0-or-later
"""Transforms applied after a bake keep baked and delivered frames in place, and outdate nothing."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import guide_baking
from hair_addon.blender.live import dynamics_state
from hair_addon.core.long_work import run_now
from tests.support import placed_hair
from tests.support.exchange.imported import select
from tests.support.pairs import pairs
from tests.support.placed_hair import require_carried, seen

LAST = 4


@pytest.fixture(scope="module")
def baked_files(blender, tmp_path_factory):
    """Return a function from one of `PLACES` to a file with simulated hair there, with baked guides."""
    folder, files = tmp_path_factory.mktemp("baked"), {}

    def file_of(place):
        if place in files:
            return files[place]
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        files[place] = str(folder / f"{len(files)}.blend")
        bpy.ops.wm.save_as_mainfile(filepath=files[place])
        body = placed_hair.add_body()
        placed_hair.PLACES[place](body)
        bpy.context.view_layer.update()
        size = placed_hair.world_scale(body)
        bpy.ops.vellus.add_hair(guide_count=6, strand_count=20, length=0.5 * size, radius=0.001 * size)
        guides, scene = bpy.data.objects["Hair Guides"].data, bpy.context.scene
        placed_hair.comb(guides)
        guides.vellus.simulates, guides.vellus.dynamics.bend_stiffness = True, 1e-9
        scene.frame_end = LAST
        run_now(guide_baking.baking([guides], LAST, scene))
        scene.frame_set(LAST)
        bpy.ops.wm.save_mainfile()
        return files[place]

    return file_of


def apply(**given):
    select(bpy.data.objects["Body"])
    bpy.ops.object.transform_apply(**({"location": False, "rotation": False, "scale": False} | given))


CHANGES = {
    "apply all": lambda: apply(location=True, rotation=True, scale=True),
    "apply scale": lambda: apply(scale=True),
    "origin to cursor": lambda: (select(bpy.data.objects["Body"]), bpy.ops.object.origin_set(type="ORIGIN_CURSOR")),
}


@pytest.mark.parametrize(("change", "place"), pairs(CHANGES, ["turned", "mirrored", "on a scaled rig"], 5))
def test_baked_frames_play_where_they_did(baked_files, place, change):
    bpy.ops.wm.open_mainfile(filepath=baked_files(place))
    scene, guides = bpy.context.scene, bpy.data.objects["Hair Guides"].data
    frames = {}
    for frame in (1, 2, LAST):
        scene.frame_set(frame)
        frames[frame] = seen()
    moved = frames[LAST].strands["Hair"][0] - frames[1].strands["Hair"][0]
    assert abs(moved).max() > 0.01 * frames[1].size
    CHANGES[change]()
    for frame in (LAST, 1, 2, LAST):
        scene.frame_set(frame)
        require_carried(frames[frame], seen())
    sentence, _values = dynamics_state.state_of(guides)
    assert sentence == "Frames {first} to {last} are baked"
    assert guides.vellus.dynamics_status == ""


def test_a_bake_after_it_is_of_the_coordinates_of_now(baked_files, tmp_path):
    bpy.ops.wm.open_mainfile(filepath=baked_files("turned"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copy.blend"))
    scene, guides = bpy.context.scene, bpy.data.objects["Hair Guides"].data
    guides.vellus.cache_identity = ""
    run_now(guide_baking.baking([guides], LAST, scene))
    scene.frame_set(LAST)
    before = seen()
    CHANGES["apply all"]()
    (baked,) = run_now(guide_baking.baking([guides], LAST, scene))
    assert baked.simulated == LAST  # one more than the last frame, from the first on
    scene.frame_set(LAST)
    require_carried(before, seen(), points=1e-3)


def test_delivered_frames_play_where_they_did(baked_files, tmp_path):
    bpy.ops.wm.open_mainfile(filepath=baked_files("turned"))
    select(bpy.data.objects["Hair"])
    bpy.ops.vellus.deliver_dynamics()
    scene = bpy.context.scene
    scene.frame_set(3)
    before = seen()
    CHANGES["apply all"]()
    scene.frame_set(3)
    require_carried(before, seen(), points=1e-4, names=["Hair"])
    select(bpy.data.objects["Hair"])
    bpy.ops.vellus.remove_delivery()
    scene.frame_set(3)
    after = seen()
    np.testing.assert_allclose(after.strands["Hair"][0], before.strands["Hair"][0], atol=1e-4 * before.size)
