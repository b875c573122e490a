# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that an animation, a slider or a bone moves: Blender carries their hair again when they have come to rest.

A script that moves a surface and reads hair sees it carried: hair is paused only while viewports draw between one move
and the next.
"""

import time

import bpy

from ..groom import paused_hair
from ..host import running, running_operators, scene_time
from ..host.caches import Cache
from ..render import hair_cache

_REST = 0.2  # seconds without a move, twice in turn, after which a surface is at rest
# Seconds between two moves that may be of one interaction: where a processor draws, a picture takes long.
_TOGETHER = 4.0

# Name prefix of operators that move objects and bones while a mouse button is held.
_TRANSFORMS = "TRANSFORM_OT_"

moved_cache = Cache()  # session_uid of a surface → when it moved, by `time.monotonic`

# session_uid of a surface → True: its mesh was reported while hair was paused, and may have other weights.
unchecked_cache = Cache()


def frame_changed(surfaces):
    """Surfaces have another shape in this frame: pause their hair while the animation plays."""
    if surfaces and scene_time.is_shown_moving():
        _pause(surfaces)


def shape_changed(surfaces):
    """Surfaces have got another shape: pause their hair if viewports have drawn the one before, a moment ago.

    To be called before their poses are invalidated.
    """
    now, dragged = time.monotonic(), set()
    for surface_object in surfaces:
        before = moved_cache.get(surface_object.session_uid)
        moved_cache.keep(surface_object.session_uid, now)
        if before is not None and now - before < _TOGETHER and hair_cache.is_pose_seen(surface_object):
            dragged.add(surface_object)
    if dragged or (surfaces and paused_hair.is_any()):
        _pause(dragged)


def _pause(surfaces):
    paused_hair.pause(surfaces)
    _cancel()  # put off with every move
    if paused_hair.is_any() and running.has_window():
        bpy.app.timers.register(settle, first_interval=_REST, persistent=True)


def settle():
    """For `bpy.app.timers`: wait once more, as the next move may have waited for a picture to be drawn."""
    bpy.app.timers.register(resume_at_rest, first_interval=_REST, persistent=True)


def resume_at_rest():
    """For `bpy.app.timers`: let Blender carry hair once nothing moves; seconds until the next try, or None."""
    if scene_time.is_shown_moving() or _is_transforming():
        return _REST
    resume()
    return None


def resume():
    """Let Blender carry all hair, before anybody may read it."""
    _cancel()
    paused_hair.resume()
    moved_cache.clear()  # what follows is no move
    for surface_object in bpy.data.objects if len(unchecked_cache) else ():
        if unchecked_cache.get(surface_object.session_uid) is not None:
            surface_object.data.update_tag()  # to be reported again
    unchecked_cache.clear()


def is_to_be_checked_later(surface_object):
    """Whether the weights of a mesh that Blender reports as edited are compared when it has come to rest.

    Sliders of shape keys report it with each move, and reading weights takes longer than all else.
    """
    is_later = paused_hair.is_any()
    if is_later:
        unchecked_cache.keep(surface_object.session_uid, True)
    return is_later


def _cancel():
    for timer in (settle, resume_at_rest):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)


def _is_transforming():
    return running_operators.is_running(_TRANSFORMS)
