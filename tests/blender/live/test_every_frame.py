# SPDX-License-Identifier: GPL-3.0-or-later
"""Play from Start plays every frame, and restores the playback settings when it stops."""

import bpy
import pytest


@pytest.fixture
def window(guides):
    """Return the window whose screen plays."""
    found = bpy.context.window_manager.windows[0]
    yield found
    with bpy.context.temp_override(window=found, screen=found.screen):
        if found.screen.is_animation_playing:
            bpy.ops.screen.animation_cancel(restore_frame=False)


def play(window):
    with bpy.context.temp_override(window=window, screen=window.screen):
        assert bpy.ops.vellus.play_dynamics() == {"FINISHED"}
    return window.screen.is_animation_playing


def stop(window):
    with bpy.context.temp_override(window=window, screen=window.screen):
        bpy.ops.screen.animation_cancel(restore_frame=False)


@pytest.mark.parametrize("sync", ["FRAME_DROP", "AUDIO_SYNC", "NONE"])
def test_no_frame_is_dropped_until_playing_stops(window, sync):
    scene = bpy.context.scene
    scene.sync_mode = sync
    assert play(window) and scene.sync_mode == "NONE"
    assert play(window) and scene.sync_mode == "NONE"  # from the start again
    stop(window)
    assert scene.sync_mode == sync


def test_what_the_artist_chooses_meanwhile_stays(window):
    scene = bpy.context.scene
    scene.sync_mode = "FRAME_DROP"
    play(window)
    scene.sync_mode = "AUDIO_SYNC"
    stop(window)
    assert scene.sync_mode == "AUDIO_SYNC"
    play(window)
    stop(window)
    assert scene.sync_mode == "AUDIO_SYNC"
