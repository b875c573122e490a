# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders from a window without Lock Interface, in which hair cannot follow its baked frames.

A message informs the user.
"""

import bpy

from ..groom.dynamics import frame_folders
from ..host import notices
from ..host.caches import Cache

SENTENCE = "In renders from this window hair follows its baked frames only with Lock Interface."

noted_cache = Cache()  # session_uid of a scene → True: a render shows the viewports' frame


def note(blender_scene):
    """Print that hair cannot follow the rendered frame, and note it for a menu in the window afterwards."""
    if any(frame_folders.has_frames(guides) for guides in frame_folders.simulating()):
        noted_cache.keep(blender_scene.session_uid, True)
        notices.say(SENTENCE)


def end(blender_scene):
    """Offer the setting for the next render when a render has ended. Called in the render's thread."""
    if noted_cache.get(blender_scene.session_uid):
        noted_cache.invalidate(blender_scene.session_uid)
        bpy.app.timers.register(offer)


def offer():
    """Show the message and the setting in a menu of the first window. A timer of Blender."""
    for window in bpy.context.window_manager.windows[:1]:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.call_menu(name="VELLUS_MT_unlocked_render")
