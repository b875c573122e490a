# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and hair with a density, whose number changes with the scale of their surface and with the unit of the scene.

Edited and painted surfaces mark them in stale_marks.py. An animated scale does not change numbers in other frames.
"""

import bpy

from ...core.errors import HairError
from ..data import scene
from ..data.strands import curves
from ..groom import bindings
from ..groom.surfaces import kept_densities
from ..host import running
from ..host.caches import Cache

# Name prefix of operators that scale objects while a mouse button is held.
_TRANSFORMS = "TRANSFORM_OT_"
_PAUSE = 0.2  # seconds between two looks whether such an operator still runs


unit_cache = Cache()  # session UID of a scene → length of a unit [m] with which its numbers were last compared


def follow_units(scene, depsgraph):
    """Mark guides and hair as stale if the scene has another Unit Scale, which Blender does not report."""
    unit = scene.unit_settings.scale_length
    before = unit_cache.get(scene.session_uid)
    if unit == before:
        return
    unit_cache.keep(scene.session_uid, unit)
    if before is None:
        return
    for one in bpy.data.hair_curves:
        surface = curves.grown_on(one)
        if surface is not None and scene in surface.users_scene:
            _follow(one, depsgraph)


def follow(transformed, depsgraph):
    """Mark guides and hair as stale if the scale of their surface, among transformed objects, has changed.

    In a window they wait for the end of a drag.
    """
    due = [one for one in bpy.data.hair_curves if transformed and _is_due(one, transformed)]
    if not due:
        return
    if running.has_window() and running.is_running(_TRANSFORMS):
        if not bpy.app.timers.is_registered(_follow_later):
            bpy.app.timers.register(_follow_later, first_interval=_PAUSE)
        return
    for one in due:
        _follow(one, depsgraph)


def _is_due(target, surfaces=None):
    surface = curves.grown_on(target)
    return (surfaces is None or surface in surfaces) and kept_densities.have_other_scale(target)


def _follow(target, depsgraph):
    """Mark guides or hair as stale if their density now gives another number; returns whether it does."""
    try:
        if not kept_densities.have_other_number(target, depsgraph):
            return False
    except HairError:
        pass  # generating them reports it
    if target.vellus.kind == "HAIR" and target.vellus.is_live:
        bindings.invalidate(target)  # otherwise unwritten hair would pass for up to date
    target.vellus.is_stale = True
    return True


def _follow_later():
    """Timer: mark what a drag has scaled; returns the seconds until the next try, or None."""
    if running.is_running(_TRANSFORMS):
        return _PAUSE
    for one in bpy.data.hair_curves:
        if _is_due(one) and _follow(one, scene.present_depsgraph()):
            one.update_tag()
    return None


def unregister():
    """Stop waiting for a drag."""
    if bpy.app.timers.is_registered(_follow_later):
        bpy.app.timers.unregister(_follow_later)
