# SPDX-License-Identifier: GPL-3.0-or-later
"""Playback without dropped frames, as guides are simulated frame by frame; restored when playback stops."""

import bpy

from ..host.caches import Cache

PLAY_EVERY_FRAME = "NONE"  # of `Scene.sync_mode`

before_cache = Cache()  # session_uid of a scene → its former `sync_mode`


def begin(blender_scene):
    """Let the next playback of a scene show every frame; returns whether the scene changed."""
    if blender_scene.sync_mode == PLAY_EVERY_FRAME:
        return False
    before_cache.keep(blender_scene.session_uid, blender_scene.sync_mode)
    blender_scene.sync_mode = PLAY_EVERY_FRAME
    return True


def end():
    """Restore the playback settings that `begin` changed, unless they were changed again since."""
    for blender_scene in bpy.data.scenes:
        before = before_cache.get(blender_scene.session_uid)
        if before is not None and blender_scene.sync_mode == PLAY_EVERY_FRAME:
            blender_scene.sync_mode = before
    before_cache.clear()
