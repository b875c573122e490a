# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces moved by an animation, a slider or a bone: Blender evaluates their hair again once they are at rest.

Hair is hidden only while viewports draw between two moves, so a script that moves a surface reads deformed hair.
"""

import time

import bpy

from ..groom import hidden_hair
from ..host import running, scene_time
from ..host.caches import Cache
from ..render import hair_cache

_REST = 0.2  # seconds; a surface is at rest after two such periods without a move
# Maximum seconds between two moves of one interaction; software rendering takes long to draw a picture.
_TOGETHER = 4.0

# Name prefix of operators that move objects and bones while a mouse button is held.
_TRANSFORMS = "TRANSFORM_OT_"

moved_cache = Cache()  # session_uid of a surface → `time.monotonic` of its last move

# session_uid of a surface → True: its mesh was reported while hair was hidden, and its weights may have changed.
unchecked_cache = Cache()


def frame_changed(surfaces):
    """Hide the hair of surfaces that are deformed in this frame, while the animation plays."""
    if surfaces and scene_time.is_shown_moving():
        _pause(surfaces)


def shape_changed(surfaces):
    """Hide the hair of deformed surfaces whose previous shape was drawn by viewports a moment ago.

    Must be called before their poses are invalidated.
    """
    now, dragged = time.monotonic(), set()
    for surface_object in surfaces:
        before = moved_cache.get(surface_object.session_uid)
        moved_cache.keep(surface_object.session_uid, now)
        if before is not None and now - before < _TOGETHER and hair_cache.is_pose_seen(surface_object):
            dragged.add(surface_object)
    if dragged or (surfaces and hidden_hair.is_any_paused()):
        _pause(dragged)


def _pause(surfaces):
    hidden_hair.pause(surfaces)
    _cancel()  # restarts the wait with every move
    if hidden_hair.is_any_paused() and running.has_window():
        bpy.app.timers.register(settle, first_interval=_REST, persistent=True)


def settle():
    """Timer: wait a second time, as the next move may have waited for a picture to be drawn."""
    bpy.app.timers.register(resume_at_rest, first_interval=_REST, persistent=True)


def resume_at_rest():
    """Timer: let Blender evaluate hair again once nothing moves; returns the seconds until the next try, or None."""
    if scene_time.is_shown_moving() or _is_transforming():
        return _REST
    resume()
    return None


def resume():
    """Let Blender evaluate all hair again, before its Curves are read."""
    _cancel()
    hidden_hair.resume()
    moved_cache.clear()  # the next update begins a new interaction
    for surface_object in bpy.data.objects if len(unchecked_cache) else ():
        if unchecked_cache.get(surface_object.session_uid) is not None:
            surface_object.data.update_tag()  # so that Blender reports it again
    unchecked_cache.clear()


def is_to_be_checked_later(surface_object):
    """Whether the weights of a mesh that Blender reports as edited are compared only once it is at rest.

    Sliders of shape keys report the mesh with each move, and reading weights is the slowest step of an update.
    """
    is_later = hidden_hair.is_any_paused()
    if is_later:
        unchecked_cache.keep(surface_object.session_uid, True)
    return is_later


def _cancel():
    for timer in (settle, resume_at_rest):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)


def _is_transforming():
    return running.is_running(_TRANSFORMS)
