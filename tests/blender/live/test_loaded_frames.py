# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are loaded without a window, and copies, show their baked frames at once."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import simulated_guides
from hair_addon.blender.render import hair_cache


@pytest.fixture
def baked(hair, tmp_path):
    """Return the hair of a scene in frame 3, the last of three baked frames in which its surface turns."""
    scene, guides, surface = bpy.context.scene, bpy.data.objects["Guides"], hair.data.surface
    surface.keyframe_insert("rotation_euler", frame=1)
    surface.rotation_euler.x = 1.0
    surface.keyframe_insert("rotation_euler", frame=3)
    guides.data.vellus.simulates, guides.data.vellus.cache_folder = True, str(tmp_path / "frames")
    scene.frame_start, scene.frame_end = 1, 3
    bpy.context.view_layer.objects.active = guides
    assert bpy.ops.vellus.bake_dynamics() == {"FINISHED"}
    scene.frame_set(3)
    return hair


@pytest.mark.parametrize("is_combed", [False, True])
def test_baked_frames_are_shown_after_loading(baked, tmp_path, is_combed):
    guides = bpy.data.objects["Guides"].data
    if is_combed:
        points = np.empty((len(guides.points), 3), np.float32)
        guides.attributes["position"].data.foreach_get("vector", points.ravel())
        guides.attributes["position"].data.foreach_set("vector", (1.1 * points).ravel())
        guides.update_tag()
        bpy.context.view_layer.update()
    assert simulated_guides.is_shown(guides)
    shown = hair_cache.strands_on_gpu(baked.data).points
    name = baked.data.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    hair = bpy.data.hair_curves[name]
    assert simulated_guides.is_shown(hair.vellus.guide_curves)
    loaded = hair_cache.strands_on_gpu(hair).points
    np.testing.assert_allclose(loaded, shown, atol=1e-5)


def test_a_damaged_frame_is_a_status_after_loading(baked, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "baked.blend"))
    (frame,) = (tmp_path / "frames").rglob("+*3.npz")
    frame.write_bytes(frame.read_bytes()[:50])
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "baked.blend"))
    guides = bpy.data.objects["Guides"].data
    assert not simulated_guides.is_shown(guides) and "Frame 3" in guides.vellus.dynamics_status


def test_baked_frames_of_copies_are_shown_at_once(baked):
    guides = bpy.data.objects["Guides"].data
    points = np.empty((len(guides.points), 3), np.float32)
    guides.attributes["position"].data.foreach_get("vector", points.ravel())
    guides.attributes["position"].data.foreach_set("vector", (1.1 * points).ravel())
    guides.update_tag()
    bpy.context.view_layer.update()
    shown = hair_cache.strands_on_gpu(baked.data).points
    bpy.ops.object.select_all(action="DESELECT")
    for one in (baked.data.surface, *baked.data.surface.children_recursive):
        one.select_set(True)
    known = {*bpy.data.hair_curves}
    bpy.ops.object.duplicate(linked=False)
    (copy,) = (one for one in {*bpy.data.hair_curves} - known if one.vellus.kind == "HAIR")
    assert copy.vellus.guide_curves != guides and simulated_guides.is_shown(copy.vellus.guide_curves)
    np.testing.assert_allclose(hair_cache.strands_on_gpu(copy).points, shown, atol=1e-5)
