# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders in a window whose interface is not locked: hair cannot follow its baked frames in them, which is said."""

import bpy

from ..groom.dynamics import frame_folders
from ..host import notices
from ..host.caches import Cache

SENTENCE = "In renders from this window hair follows its baked frames only with Lock Interface."

noted_cache = Cache()  # session_uid of a scene → True: a render shows it as its viewports did


def note(blender_scene):
    """A frame is rendered that hair cannot follow: say so in the console now, and in the window afterwards."""
    if any(frame_folders.has_frames(guides) for guides in frame_folders.simulating()):
        noted_cache.keep(blender_scene.session_uid, True)
        notices.say(SENTENCE)


def end(blender_scene):
    """The render has ended: offer the setting for the next one. Called in the render's thread."""
    if noted_cache.get(blender_scene.session_uid):
        noted_cache.invalidate(blender_scene.session_uid)
        bpy.app.timers.register(offer)


def offer():
    """For `bpy.app.timers`: the sentence and the setting, in a menu of the first window."""
    for window in bpy.context.window_manager.windows[:1]:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.call_menu(name="VELLUS_MT_unlocked_render")
