# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides are simulated correctly in scenes of other units, scales and frames, on bending surfaces, and with styles."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.simulation import guide_poses
from hair_addon.blender.data.strands import simulated_guides
from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.blender.host import running
from hair_addon.blender.live import dynamics_state, handlers, invalidation, live_hair
from hair_addon.core.files.frame_cache import FrameCache
from hair_addon.core.long_work import run_now
from tests.support.dynamics.swung import SWINGS, simulate, swing
from tests.support.reading import evaluated_points, points, write_points


@pytest.fixture
def window(monkeypatch):
    """Act as in a window, so that guides are simulated while frames change."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    yield
    live_hair.cancel_writing()
    invalidation.clear()


@pytest.fixture
def swung(hair, tmp_path, window):
    """Return (guides, hair) that simulate on a swinging sphere."""
    guides = bpy.data.objects["Guides"]
    swing(bpy.data.objects["Sphere"])
    simulate(guides, tmp_path)
    return guides, hair


def played(guides, first=1, last=6):
    """Return simulated points of guides in the last of some frames, in local coordinates at rest."""
    for frame in range(first, last + 1):
        bpy.context.scene.frame_set(frame)
    return simulated_guides.point_cache.get(guides.data.session_uid).copy()


def drawn(hair):
    live_hair.write_all()
    return points(hair)


def require_roots_on(surface, hair, within):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    evaluated = surface.evaluated_get(depsgraph)
    to_surface = np.array(surface.matrix_world.inverted() @ hair.matrix_world)
    for root in evaluated_points(hair)[::10, 0]:
        place = to_surface[:3, :3] @ root + to_surface[:3, 3]
        found, nearest, *_ = evaluated.closest_point_on_mesh([float(component) for component in place])
        assert found and np.linalg.norm(np.array(nearest) - place) < within


def test_units_of_the_scene_do_not_matter(swung):
    """Hair that is a hundred times as large in units of a hundredth of a meter moves the same."""
    guides, _hair = swung
    guides.data.vellus.dynamics.cell_size = 0.2
    expected = played(guides)
    bpy.context.scene.frame_set(1)
    bpy.data.objects["Sphere"].scale = (100.0, 100.0, 100.0)
    bpy.context.scene.unit_settings.scale_length = 0.01
    guides.data.vellus.dynamics.collision_distance *= 100.0
    guides.data.vellus.dynamics.cell_size *= 100.0
    # A thousandth of a strand: contact enlarges what is rounded otherwise.
    np.testing.assert_allclose(played(guides), expected, atol=5e-4)


def test_a_mirrored_surface_moves_hair_as_its_mirror_image(swung):
    """A mirrored surface moves hair as its mirror image, except for friction between hairs, whose grid is not
    symmetric.
    """
    guides, _hair = swung
    settings = guides.data.vellus.dynamics
    settings.hair_friction = settings.hair_pressure = 0.0
    expected = played(guides)
    ball = bpy.data.objects["Sphere"]
    ball.scale.x = -1.0
    for frame, angle in SWINGS:
        ball.rotation_euler.y = -angle
        ball.keyframe_insert("rotation_euler", frame=frame)
    mirrored = played(guides)
    np.testing.assert_allclose(mirrored, expected, atol=1e-4)


def test_an_unevenly_scaled_surface_keeps_hair_at_its_roots(swung):
    guides, hair = swung
    bpy.data.objects["Sphere"].scale = (1.0, 2.0, 0.5)
    found = played(guides)
    assert np.isfinite(found).all()
    np.testing.assert_array_equal(found[:, 0], points(guides)[:, 0])
    drawn(hair)
    require_roots_on(bpy.data.objects["Sphere"], hair, 1e-4)


def test_hair_follows_simulated_guides_as_combed_ones(swung):
    """Guides that are combed to their simulated positions have the same hair, with styles too."""
    guides, hair = swung
    bpy.context.view_layer.objects.active = hair
    bpy.ops.vellus.add_style(style="CURL")
    bpy.ops.vellus.add_style(style="TRIM")
    bpy.context.view_layer.update()
    straight = drawn(hair)
    there = played(guides)
    styled = drawn(hair)
    assert np.abs(styled - straight).max() > 1e-2
    guides.data.vellus.simulates = False
    write_points(guides, there)
    np.testing.assert_allclose(drawn(hair), styled, atol=1e-5)


def test_a_style_is_changed_while_simulated_frames_are_shown(swung):
    guides, hair = swung
    there = played(guides)
    bpy.context.view_layer.objects.active = hair
    bpy.ops.vellus.add_style(style="TRIM")
    hair.data.vellus.styles["Trim"].trim.factor = 0.5
    bpy.context.view_layer.update()
    styled = drawn(hair)
    guides.data.vellus.simulates = False
    write_points(guides, there)
    np.testing.assert_allclose(drawn(hair), styled, atol=1e-5)


def test_systems_on_one_surface_do_not_meet(swung, tmp_path):
    """Hair systems on one surface move as they do alone."""
    guides, hair = swung
    alone, strands = played(guides), None
    strands = drawn(hair)
    ball = bpy.data.objects["Sphere"]
    bpy.context.scene.frame_set(1)
    bpy.context.view_layer.objects.active = ball
    bpy.ops.object.select_all(action="DESELECT")
    ball.select_set(True)
    bpy.ops.vellus.add_hair(guide_count=20, length=0.3, strand_count=50)
    other = next(o for o in bpy.data.objects if o.type == "CURVES" and o.data.vellus.kind == "GUIDES" and o != guides)
    simulate(other, tmp_path, gravity=-1.0)
    np.testing.assert_array_equal(played(guides), alone)
    np.testing.assert_array_equal(drawn(hair), strands)
    there = simulated_guides.point_cache.get(other.data.session_uid)
    assert len(there) == 20 and not np.array_equal(there, points(other))


def test_a_subdivided_surface_keeps_its_roots(swung):
    guides, hair = swung
    ball = bpy.data.objects["Sphere"]
    ball.modifiers.new("Subdivision", "SUBSURF").levels = 1
    bpy.context.view_layer.update()
    played(guides)
    assert guides.data.vellus.dynamics_status == ""
    drawn(hair)
    require_roots_on(ball, hair, 1e-3)


def test_roots_stay_on_a_surface_that_an_armature_bends(arm, tmp_path, window):
    bpy.context.view_layer.objects.active = arm
    bpy.ops.object.select_all(action="DESELECT")
    arm.select_set(True)
    bpy.ops.vellus.add_hair(guide_count=40, length=0.4, strand_count=200)
    guides, hair = bpy.data.objects["Hair Guides"], bpy.data.objects["Hair"]
    simulate(guides, tmp_path)
    there = played(guides, 1, 9)
    pose = guide_poses.read(guides.data, bpy.context.evaluated_depsgraph_get(), 1.0)
    np.testing.assert_allclose(pose.to_world(there)[:, 0], pose.root_positions, atol=1e-5)
    drawn(hair)
    require_roots_on(arm, hair, 1e-4)


def test_frames_may_be_negative(swung):
    """Simulated and baked frames are the same for any number of the first frame, also negative ones."""
    guides, _hair = swung
    bpy.data.objects["Sphere"].animation_data_clear()
    guides.data.vellus.dynamics.sag_free = False
    fallen = played(guides, 1, 6)
    guides.data.vellus.dynamics.start_frame = -3
    np.testing.assert_array_equal(played(guides, -3, 2), fallen)
    run_now(guide_baking.baking([guides.data], 1, bpy.context.scene))
    assert FrameCache(frame_folders.folder_of(guides.data)).frame_numbers() == list(range(-3, 3))
    bpy.context.scene.frame_set(-1)
    bpy.context.scene.frame_set(2)
    np.testing.assert_array_equal(simulated_guides.point_cache.get(guides.data.session_uid), fallen)


def test_slow_motion_is_the_same_motion(swung):
    """With Time Stretching, twice as many frames show the same motion, simulated or baked."""
    guides, hair = swung
    dynamics = guides.data.vellus.dynamics
    dynamics.automatic_substeps, dynamics.sag_free, dynamics.substeps = False, False, 8
    bpy.data.objects["Sphere"].animation_data_clear()
    falls = played(guides, 1, 6)
    dynamics.substeps = 4
    render = bpy.context.scene.render
    render.frame_map_old, render.frame_map_new = 100, 200
    np.testing.assert_array_equal(played(guides, 1, 11), falls)
    run_now(guide_baking.baking([guides.data], 11, bpy.context.scene))
    for frame in (3, 11):
        bpy.context.scene.frame_set(frame)
    np.testing.assert_array_equal(simulated_guides.point_cache.get(guides.data.session_uid), falls)
    shown = drawn(hair)
    bpy.context.scene.frame_set(5)
    assert np.abs(drawn(hair) - shown).max() > 0.01
    render.frame_map_new = 100
    bpy.context.scene.frame_set(6)
    assert "with other settings" in dynamics_state.state_of(guides.data)[0]


def test_skipped_frames_are_not_simulated(swung):
    """With a frame step or dropped frames, the last known state stays shown."""
    guides, _hair = swung
    third = played(guides, 1, 3)
    for frame in (5, 7, 9):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_array_equal(simulated_guides.point_cache.get(guides.data.session_uid), third)
        sentence, values = dynamics_state.state_of(guides.data)
        assert "skipped" in sentence and values == {"frame": 3}
    assert not np.array_equal(played(guides, 4, 4), third)


def test_frames_of_other_scenes_move_no_guides(swung):
    guides, _hair = swung
    expected = [played(guides, last=6), played(guides, 7, 7)]
    other = bpy.data.scenes.new("Other")
    shown = played(guides, last=6)
    for frame in (3, 7):
        other.frame_set(frame)
        np.testing.assert_array_equal(simulated_guides.point_cache.get(guides.data.session_uid), shown)
    np.testing.assert_array_equal([shown, played(guides, 7, 7)], expected)


def test_guides_of_another_scene_are_shown_by_its_next_update_after_undo(swung):
    """An undo while another scene is shown reports no update of the guides' scene."""
    guides, _hair = swung
    sixth = played(guides)
    other, empty = bpy.data.scenes.new("Other"), bpy.data.objects.new("Empty", None)
    other.collection.objects.link(empty)
    other.view_layers[0].update()
    handlers.after_undo()
    empty.location.x = 1.0
    other.view_layers[0].update()
    guides.update_tag()
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(simulated_guides.point_cache.get(guides.data.session_uid), sixth)
