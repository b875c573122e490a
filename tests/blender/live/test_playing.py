# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides simulated during playback in a window have frames in memory, and certain events restart the simulation."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.data.strands import simulated_guides
from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.blender.host import running
from hair_addon.blender.live import (
    dynamics_state,
    handlers,
    invalidation,
    live_hair,
    simulated_hair,
    unlocked_renders,
)
from hair_addon.core.long_work import run_now
from tests.blender.data.strands.test_partings import draw_line
from tests.support.dynamics.swung import simulate, swing
from tests.support.interface.layout import draw
from tests.support.reading import points, write_points


@pytest.fixture
def swung(hair, tmp_path, monkeypatch):
    """Return (guides, hair) that simulate on a swinging sphere, as in a window."""
    monkeypatch.setattr(running, "has_window", lambda: True)
    guides = bpy.data.objects["Guides"]
    swing(bpy.data.objects["Sphere"])
    simulate(guides, tmp_path)
    yield guides, hair
    live_hair.cancel_writing()
    invalidation.clear()


def play(first, last):
    for frame in range(first, last + 1):
        bpy.context.scene.frame_set(frame)


def shown(guides):
    """Return the points of guides as shown: simulated, or as combed."""
    found = simulated_guides.point_cache.get(guides.data.session_uid)
    return points(guides) if found is None else found


def drawn(hair):
    live_hair.write_all()
    return points(hair)


def test_keys_of_settings_do_not_outdate_what_was_played(swung):
    settings = swung[0].data.vellus.dynamics
    for frame, drag in ((1, 1.0), (8, 3.0)):
        settings.air_drag = drag
        settings.keyframe_insert("air_drag", frame=frame)
    play(1, 5)
    sentence, values = dynamics_state.state_of(swung[0].data)
    assert sentence.startswith("Simulated up to frame") and values["frame"] == 5
    settings.damping = 0.1
    play(6, 7)
    assert "other settings" in dynamics_state.state_of(swung[0].data)[0]


def test_playing_is_what_baking_gives(swung):
    guides, hair = swung
    play(1, 8)
    played, strands = shown(guides).copy(), drawn(hair)
    run_now(guide_baking.baking([guides.data], 9, bpy.context.scene))
    bpy.context.scene.frame_set(1)
    bpy.context.scene.frame_set(8)
    assert np.array_equal(shown(guides), played)
    assert np.array_equal(drawn(hair), strands)


def test_the_present_frame_is_shown_as_it_is_baked_and_as_combed_when_freed(swung):
    guides, hair = swung
    combed = drawn(hair)
    bpy.context.scene.frame_set(8)
    run_now(guide_baking.baking([guides.data], 9, bpy.context.scene))
    bpy.context.view_layer.update()
    baked, strands = shown(guides).copy(), drawn(hair)
    assert dynamics_state.state_of(guides.data) == ("Frames {first} to {last} are baked", {"first": 1, "last": 9})
    play(7, 8)
    assert np.array_equal(shown(guides), baked)
    np.testing.assert_allclose(drawn(hair), strands, atol=1e-6)
    assert not np.array_equal(shown(guides), points(guides))
    bpy.context.view_layer.objects.active = guides
    assert bpy.ops.vellus.free_dynamics() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert np.array_equal(shown(guides), points(guides))
    np.testing.assert_allclose(drawn(hair), combed, atol=1e-6)
    assert "Not simulated" in dynamics_state.state_of(guides.data)[0]


def test_a_file_that_was_never_saved_has_no_frames_to_free(swung):
    """A file that was never saved has no cache folder and no frames to free, and panels that redraw do not fail."""
    guides, _hair = swung
    assert not bpy.data.filepath
    guides.data.vellus.cache_folder = "//haircache"
    play(1, 3)
    bpy.context.view_layer.objects.active = guides
    assert frame_folders.frames_of(guides.data) is None and not frame_folders.has_frames(guides.data)
    assert not bpy.ops.vellus.free_dynamics.poll()


def test_a_jump_simulates_nothing(swung, monkeypatch):
    guides, _hair = swung
    play(1, 6)
    sixth = shown(guides).copy()
    monkeypatch.setattr(simulated_hair, "_advance", lambda *_: pytest.fail("simulated"))
    bpy.context.scene.frame_set(40)  # unknown: the last known one before
    assert np.array_equal(shown(guides), sixth)
    bpy.context.scene.frame_set(4)
    assert not np.array_equal(shown(guides), sixth)
    bpy.context.scene.frame_set(6)
    assert np.array_equal(shown(guides), sixth)


@pytest.mark.usefixtures("made_anew")
def test_the_start_frame_begins_again(swung):
    guides, hair = swung
    before = drawn(hair)
    play(1, 6)
    first = shown(guides).copy()
    bpy.context.scene.frame_set(1)
    assert np.array_equal(shown(guides), points(guides))
    assert np.array_equal(drawn(hair), before)
    play(2, 6)
    assert np.array_equal(shown(guides), first)


def test_a_setting_takes_effect_with_the_next_frame(swung):
    guides, _hair = swung
    play(1, 6)
    sixth = shown(guides).copy()
    guides.data.vellus.dynamics.gravity = -5.0
    bpy.context.view_layer.update()
    assert np.array_equal(shown(guides), sixth)
    play(7, 9)
    assert dynamics_state.state_of(guides.data)[1]["frame"] == 6
    bpy.context.scene.frame_set(1)
    guides.data.vellus.dynamics.gravity = 1.0
    other = shown(guides).copy()
    play(2, 9)
    assert not np.array_equal(shown(guides), other)


def test_a_part_line_takes_effect_with_the_next_frame(swung):
    """Frames before a new part line are outdated; a part line that divides the guides as before changes nothing."""
    guides, hair = swung
    guides.data.vellus.dynamics.hair_friction = 50.0
    draw_line((0.0, -0.9, 1.2), (0.0, 0.9, 1.2))
    bpy.context.view_layer.update()
    play(1, 9)
    unparted = shown(guides).copy()
    play(1, 6)
    hair.data.vellus.hair.part_lines = "Line"
    bpy.context.view_layer.update()
    play(7, 9)
    sentence, values = dynamics_state.state_of(guides.data)
    assert "other settings" in sentence and values["frame"] == 6
    assert not np.array_equal(shown(guides), unparted)
    play(1, 6)
    hair.data.vellus.hair.seed += 1
    bpy.context.view_layer.update()
    play(7, 9)
    assert dynamics_state.state_of(guides.data)[0].startswith("Simulated up to frame")


@pytest.mark.usefixtures("made_anew")
def test_switched_off_guides_are_as_combed(swung):
    guides, hair = swung
    before = drawn(hair)
    play(1, 6)
    guides.data.vellus.simulates = False
    bpy.context.view_layer.update()
    assert np.array_equal(shown(guides), points(guides))
    assert np.array_equal(drawn(hair), before)


def test_combed_while_playing(swung):
    """Combing during playback ends the simulation, which restarts in the start frame."""
    guides, _hair = swung
    play(1, 6)
    combed = points(guides)
    combed[:, 1:] += 0.01
    write_points(guides, combed)
    bpy.context.scene.frame_set(7)
    assert np.array_equal(shown(guides), combed)
    bpy.context.scene.frame_set(5)  # simulated with other guides
    assert np.array_equal(shown(guides), combed)
    play(1, 3)
    assert not np.array_equal(shown(guides), combed)


def test_deleted_or_undone_guides_end_what_is_played(swung):
    guides, hair = swung
    play(1, 6)
    handlers.after_undo()
    bpy.context.scene.frame_set(7)
    assert guides.data.vellus.dynamics_status == ""
    bpy.data.objects.remove(guides)
    bpy.data.hair_curves.remove(bpy.data.hair_curves["Guides"])
    play(8, 10)
    assert len(points(hair)) == 500


def test_undo_shows_the_frame_that_was_shown(swung):
    """Undo restores Blender's data with combed guides, and the shown simulated frame remains."""
    guides, hair = swung
    play(1, 6)
    sixth, strands = shown(guides).copy(), drawn(hair)
    handlers.after_undo()
    bpy.context.view_layer.objects.active.update_tag()
    bpy.context.view_layer.update()
    assert np.array_equal(shown(guides), sixth)
    np.testing.assert_allclose(drawn(hair), strands, atol=1e-6)  # bound anew


def test_undone_combing_ends_what_is_played(swung):
    guides, _hair = swung
    play(1, 6)
    combed = points(guides)
    combed[:, 1:] += 0.01
    handlers.after_undo()
    write_points(guides, combed)
    bpy.context.view_layer.update()
    assert np.array_equal(shown(guides), combed)


def test_a_surface_without_faces_is_reported(swung):
    guides, hair = swung
    play(1, 3)
    bpy.data.objects["Sphere"].data.clear_geometry()
    bpy.context.scene.frame_set(4)
    assert guides.data.vellus.dynamics_status != ""
    assert np.isfinite(drawn(hair)).all()


def test_without_a_window_nothing_is_simulated(swung, monkeypatch):
    """Without a window nothing is simulated, so farms and scripts read only baked frames."""
    guides, _hair = swung
    monkeypatch.setattr(running, "has_window", lambda: False)
    play(1, 6)
    assert np.array_equal(shown(guides), points(guides))


def test_colliders_that_are_left_out_are_named_in_the_panel(swung):
    guides, _hair = swung
    collection = bpy.data.collections.new("Body")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("Empty Mesh", bpy.data.meshes.new("Empty Mesh")))
    guides.data.vellus.dynamics.colliders = "Body"
    play(1, 3)
    bpy.context.view_layer.objects.active = guides
    assert any("Empty Mesh" in text for text in draw(bpy.types.VELLUS_PT_dynamics).texts)
    bpy.data.objects.remove(bpy.data.objects["Empty Mesh"])
    play(4, 4)
    assert not any("Empty Mesh" in text for text in draw(bpy.types.VELLUS_PT_dynamics).texts)


def test_baked_frames_can_be_simulated_again_from_the_panel(swung):
    guides, _hair = swung
    bpy.context.view_layer.objects.active = guides
    before = draw(bpy.types.VELLUS_PT_dynamics).drawn["vellus.bake_dynamics"]
    run_now(guide_baking.baking([guides.data], 3, bpy.context.scene))
    bpy.context.scene.frame_set(2)
    assert draw(bpy.types.VELLUS_PT_dynamics).drawn["vellus.bake_dynamics"] == before + 1


def test_why_guides_are_not_simulated_stays_shown(swung):
    guides, _hair = swung
    guides.data.remove_curves()
    bpy.context.view_layer.update()
    play(1, 3)
    assert "no guides" in guides.data.vellus.dynamics_status


def test_renders_that_hair_cannot_follow_are_reported_with_the_setting(swung, capsys):
    guides, _hair = swung
    scene = bpy.context.scene
    bpy.context.view_layer.objects.active = guides
    panel = bpy.types.VELLUS_PT_dynamics
    unlocked_renders.note(scene)
    unlocked_renders.end(scene)
    assert not draw(panel).drawn["use_lock_interface"] and not bpy.app.timers.is_registered(unlocked_renders.offer)
    run_now(guide_baking.baking([guides.data], 3, scene))
    scene.frame_set(2)
    assert draw(panel).drawn["use_lock_interface"] and unlocked_renders.SENTENCE in " ".join(draw(panel).texts)
    unlocked_renders.note(scene)
    unlocked_renders.note(scene)
    assert capsys.readouterr().err.count(unlocked_renders.SENTENCE) == 1
    unlocked_renders.end(scene)
    assert bpy.app.timers.is_registered(unlocked_renders.offer)
    bpy.app.timers.unregister(unlocked_renders.offer)
    scene.render.use_lock_interface = True
    assert not draw(panel).drawn["use_lock_interface"]


def test_fast_motion_in_few_substeps_is_reported(swung):
    settings = swung[0].data.vellus.dynamics
    settings.automatic_substeps, settings.substeps = False, 1
    play(1, 5)
    sentence, values = dynamics_state.state_of(swung[0].data)
    assert "use Automatic Substeps" in sentence and values["asked"] > values["count"] == 1
    settings.automatic_substeps = True
    play(6, 6)
    assert "use Automatic Substeps" not in dynamics_state.state_of(swung[0].data)[0]
