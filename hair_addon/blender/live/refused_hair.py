# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that is missing in composited renders: Blender prints errors of the hair's scene, but does not show them."""

import bpy

from ..render.frames import composite


def begin():
    """Clear the refusals of earlier renders when a render begins."""
    composite.refused_cache.clear()


def end(blender_scene):
    """Report missing hair when a render has ended. Called in the render's thread."""
    if composite.refusals(blender_scene) and not bpy.app.timers.is_registered(offer):
        bpy.app.timers.register(offer)


def offer():
    """Timer: show the refusals in a menu of the first window."""
    for window in bpy.context.window_manager.windows[:1]:
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.call_menu(name="VELLUS_MT_refused_hair")
