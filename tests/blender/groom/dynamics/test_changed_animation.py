# SPDX-License-Identifier: GPL-3.0-or-later
"""A changed animation of baked frames is detected when a changed frame is shown, and simulated again from there."""

import bpy
import numpy as np
import pytest

from hair_addon.blender.groom.dynamics import frame_folders, guide_baking
from hair_addon.blender.live import dynamics_state
from hair_addon.core.files import frame_cache
from hair_addon.core.long_work import Stopped, run_now
from tests.support.dynamics.swung import simulate, swing

LAST = 30  # a state is kept after frame 25


@pytest.fixture
def guides(hair, tmp_path):
    """Return guides that simulate on a swinging sphere, and collide with a ball of the collection Body."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.3, location=(1.3, 0.0, 0.0))
    ball = bpy.context.object
    ball.name = "Ball"
    body = bpy.data.collections.new("Body")
    bpy.context.scene.collection.children.link(body)
    body.objects.link(ball)
    swing(bpy.data.objects["Sphere"])
    guides = bpy.data.objects["Guides"]
    simulate(guides, tmp_path / "frames", colliders="Body")
    return guides


def bake(guides, last=LAST, starts_over=False, stops_at=None):
    """Bake, and return how many frames were simulated."""

    def progress(step, _part):
        if step == f"Frame {stops_at}":
            raise Stopped

    try:
        (baked,) = run_now(guide_baking.baking([guides.data], last, bpy.context.scene, starts_over), progress)
    except Stopped:
        return None
    return baked.simulated


def files_of(guides):
    folder = frame_folders.folder_of(guides.data)
    return {path.name: path.read_bytes() for path in folder.glob("*.npz")}


def reported(guides, *frames):
    for frame in frames:
        bpy.context.scene.frame_set(frame)
    return dynamics_state.state_of(guides.data)


def turn(angle, frame):
    """Change the angle of the surface in a frame."""
    ball = bpy.data.objects["Sphere"]
    ball.rotation_euler.y = angle
    ball.keyframe_insert("rotation_euler", frame=frame)


def lift_ball(frame):
    """Animate the ball to rise from a frame on, during ten frames."""
    ball = bpy.data.objects["Ball"]
    for number, height in ((frame, 0.0), (frame + 10, 0.4)):
        ball.location.z = height
        ball.keyframe_insert("location", frame=number)


def test_frames_of_another_animation_are_reported(guides):
    bake(guides, 20)
    assert reported(guides, 1, 5, 12, 20)[0] == "Frames {first} to {last} are baked"
    turn(0.3, 16)
    assert reported(guides, *range(1, 21)) == (
        "Frames from {frame} on are baked with another animation of the surface: bake again",
        {"frame": 12},
    )
    turn(0.0, 16)
    assert reported(guides, *range(1, 21))[0] == "Frames {first} to {last} are baked"
    lift_ball(6)
    sentence = "Frames from {frame} on are baked with other colliders, forces or keys: bake again"
    assert reported(guides, *range(1, 21)) == (sentence, {"frame": 7})
    bake(guides, 20)
    assert reported(guides, *range(1, 21))[0] == "Frames {first} to {last} are baked"
    bpy.context.scene.gravity.z = -5.0
    assert reported(guides, 9, 4) == (sentence, {"frame": 4})


def test_other_keys_of_a_setting_are_reported(guides):
    settings = guides.data.vellus.dynamics
    for frame, drag in ((6, 1.0), (12, 2.0)):
        settings.air_drag = drag
        settings.keyframe_insert("air_drag", frame=frame)
    bake(guides, 20)
    assert reported(guides, *range(1, 21))[0] == "Frames {first} to {last} are baked"
    settings.air_drag = 3.0
    settings.keyframe_insert("air_drag", frame=12)
    sentence = "Frames from {frame} on are baked with other colliders, forces or keys: bake again"
    assert reported(guides, *range(1, 21)) == (sentence, {"frame": 7})


def test_baked_frames_are_of_the_same_animation_in_another_session(guides, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bake(guides, 6)
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    guides = bpy.data.objects["Guides"]
    assert reported(guides, *range(1, 7))[0] == "Frames {first} to {last} are baked"
    assert bake(guides, 6) == 0


def test_baking_goes_on_before_what_has_changed(guides):
    bake(guides)
    lift_ball(27)
    assert bake(guides) == LAST + 1 - 25  # from the state after frame 25
    found = files_of(guides)
    bake(guides, starts_over=True)
    assert files_of(guides) == found


def test_frames_after_a_change_that_is_over_are_simulated_again(guides):
    """Frames are simulated again if earlier frames have changed, even if their own animation has not."""
    bake(guides)
    turn(0.3, 6)
    bake(guides, stops_at=21)  # all that has changed is baked again: the surface stands still from frame 16 on
    bake(guides)
    found = files_of(guides)
    bake(guides, starts_over=True)
    assert files_of(guides) == found


def test_baking_goes_on_with_a_collider_that_stopped(guides):
    """A collider whose topology changes keeps its last pose, and baking continues, also after an interruption."""
    ball = bpy.data.objects["Ball"]
    for frame, height in ((1, 0.0), (20, 0.5)):
        ball.location.z = height
        ball.keyframe_insert("location", frame=frame)
    divided = ball.modifiers.new("Subdivision", "SUBSURF")
    for frame, is_shown in ((1, False), (12, True)):
        divided.show_viewport = is_shown
        divided.keyframe_insert("show_viewport", frame=frame)
    bake(guides, 30, stops_at=28)
    cache = frame_cache.FrameCache(frame_folders.folder_of(guides.data))
    assert cache.state_numbers() == [25]
    bake(guides, 30)
    found = files_of(guides)
    bake(guides, 30, starts_over=True)
    assert files_of(guides).keys() == found.keys()
    assert files_of(guides) == found


def test_what_is_said_is_kept_while_baked_frames_play(guides, monkeypatch):
    bake(guides, 8)
    reported(guides, 1, 2)
    asked, key_of = [], guide_baking.key_of
    monkeypatch.setattr(guide_baking, "key_of", lambda *given: asked.append(given) or key_of(*given))
    assert reported(guides, *range(3, 9))[0] == "Frames {first} to {last} are baked"
    assert not asked
    guides.data.vellus.dynamics.damping = 0.1
    assert "with other settings or guides" in reported(guides, 5)[0]
    guides.data.vellus.dynamics.damping = 0.005
    moved = np.array([0.0, 0.0, 0.1], np.float32) + guides.data.attributes["position"].data[40].vector
    guides.data.attributes["position"].data[40].vector = moved
    assert "with other settings or guides" in reported(guides, 5)[0]
