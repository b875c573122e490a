# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that a render lacks, or shows as it is combed: composited hair, whose errors Blender prints, but does not show,
and hair whose baked frames another engine did not find.
"""

import bpy

from ..host.caches import Cache
from ..host.notices import say
from ..render.frames import composite
from ..settings.translations import error_text

noted_cache = Cache()  # session_uid of a scene that another engine renders → messages about its last render


def begin():
    """Clear the refusals of earlier renders when a render begins."""
    composite.refused_cache.clear()
    noted_cache.clear()


def note(blender_scene, error):
    """Say that a frame does not show some hair as it should: now in the console, afterwards in the window."""
    sentences = noted_cache.get(blender_scene.session_uid, list)
    sentence = error_text(error)
    sentences += [] if sentence in sentences else [sentence]
    say(sentence)


def sentences_of(blender_scene):
    """Sentences on the last render of a scene."""
    return [*composite.refusals(blender_scene), *(noted_cache.get(blender_scene.session_uid) or ())]


def end(blender_scene):
    """Report missing hair when a render has ended. Called in the render's thread."""
    if sentences_of(blender_scene) and not bpy.app.timers.is_registered(offer):
        bpy.app.timers.register(offer)


def offer():
    """Timer: show the refusals in a menu of the first window."""
    for window in bpy.context.window_manager.windows[:1]:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.call_menu(name="VELLUS_MT_refused_hair")
