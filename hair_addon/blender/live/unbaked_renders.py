# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders by other engines of frames that are not baked: Blender would draw the hair as it is combed.

Vellus refuses to render such a frame, but an add-on cannot stop another engine. If Blender was started from the command
line to render, it exits before the frame with a message and status 1; in a window the message is shown.
"""

import sys

import bpy

from ...core.errors import HairError
from ..groom.dynamics import frame_folders
from ..host import running, scene_time
from ..render.frames import composite
from ..settings.translations import error_text
from . import refused_hair

_RENDERS = {"-a", "--render-anim", "-f", "--render-frame"}  # words of Blender's command line


def before_frame(blender_scene):
    """Refuse a frame that is about to be rendered unbaked. Called in the render's thread if there is a window."""
    is_other = blender_scene.render.engine != "VELLUS" and not composite.is_on(blender_scene)
    if not is_other or not (_is_by_command() or _is_animation()):
        return
    try:
        frame_folders.require_baked([scene_time.frame_of(blender_scene)], blender_scene)
    except HairError as error:
        if running.has_window():
            refused_hair.note(blender_scene, error)
            return
        print(f"Vellus: {error_text(error)}", file=sys.stderr, flush=True)
        raise SystemExit(1) from error


def _is_by_command():
    """Whether Blender, not Python with the bpy module, was started without a window to render."""
    words = sys.argv[: sys.argv.index("--")] if "--" in sys.argv else sys.argv
    return not running.has_window() and bool(bpy.app.binary_path) and not _RENDERS.isdisjoint(words)


def _is_animation():
    """Whether a window renders an animation: still pictures of frames that are not baked are allowed."""
    rendering = (one for one in running.found() if one.bl_idname == "RENDER_OT_render")
    return running.has_window() and any(one.properties.animation for one in rendering)
