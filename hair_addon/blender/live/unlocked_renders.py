# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders in a window whose interface is not locked: hair cannot follow its baked frames in them, which is said."""

import bpy

from ..groom import frame_folders
from ..host import notices
from ..host.caches import Cache
from ..settings.translations import interface_text

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
    """For `bpy.app.timers`: a popup with the sentence and the setting."""
    for window in bpy.context.window_manager.windows[:1]:
        with bpy.context.temp_override(window=window):
            title = interface_text("Hair in This Render")
            bpy.context.window_manager.popup_menu(_draw, title=title, icon="ERROR")


def _draw(popup, context):
    popup.layout.label(text=interface_text(SENTENCE), translate=False)
    draw_setting(popup.layout, context)


def draw_setting(layout, context):
    """The setting that the sentence names, as a check box."""
    layout.prop(context.scene.render, "use_lock_interface")
