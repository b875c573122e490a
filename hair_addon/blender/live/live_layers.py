# SPDX-License-Identifier: GPL-3.0-or-later
"""Live layers of guides: strokes are recorded in the active layer at their end, and changed weights move guides.

In a window recording waits until a stroke has ended, so that its events cost nothing more. Without a window and
in updates by scripts, guides are recorded at once.
"""

import bpy

from ...core.errors import HairError
from ..data import scene
from ..data.strands import attributes
from ..host import running, scene_time
from ..layers import recording
from ..settings import layer_items
from . import events, live_hair

_PAUSE = 0.3  # [s] without a change after which a stroke is over, unless its operator still runs


def follow(combed, depsgraph):
    """Record combed guides and compose guides with changed weights; guides that moved are added to `combed`.

    combed: {guide Curves that have moved: their (N, 3) points, or None to be read}.
    """
    for guides in with_layers():
        if not layer_items.is_reweighed(guides.vellus):
            if guides not in combed:
                continue
            if running.may_wait():
                record_soon()
                continue
        if running.has_window() and live_hair.is_stroke_running():
            record_soon()
        elif _update(guides, depsgraph):
            combed[guides] = None


def follow_masks(surfaces, depsgraph):
    """Mark layers whose masks on edited surfaces were painted, so that `follow` composes their guides again."""
    for guides in with_layers():
        if guides.surface in surfaces and running.job() is None:
            recording.mark_painted(guides, depsgraph)


def follow_frame(depsgraph):
    """Compose guides with layers whose weight or visibility is animated; returns {guide Curves that moved: None}."""
    moved = {}
    for guides in with_layers():
        if guides.animation_data is None:
            continue
        if scene_time.is_rendered(depsgraph):  # Blender animates the original values only for viewports
            animated = guides.evaluated_get(depsgraph).vellus.layers
            for item, other in zip(guides.vellus.layers, animated, strict=False):
                for name in ("is_on", "weight"):
                    if getattr(item, name) != getattr(other, name):
                        setattr(item, name, getattr(other, name))
        if layer_items.is_reweighed(guides.vellus) and _update(guides, depsgraph):
            moved[guides] = None
    return moved


def record_all():
    """Record all combed guides: at the end of an interaction, or before guides are read."""
    cancel()
    for guides in with_layers():
        if recording.is_outdated(guides) and not running.is_rendering():
            _update(guides, scene.present_depsgraph())


def record_soon():
    """Record after a pause in which nothing changes."""
    cancel()
    bpy.app.timers.register(_record_after_pause, first_interval=_PAUSE, persistent=True)


def cancel():
    """Drop a pending recording after undo, redo and a new file."""
    if bpy.app.timers.is_registered(_record_after_pause):
        bpy.app.timers.unregister(_record_after_pause)


def _record_after_pause():
    if live_hair.is_stroke_running():
        return _PAUSE
    record_all()
    return None


def with_layers():
    """Return the guides of this file that have layers."""
    found = [c for c in bpy.data.hair_curves if c.vellus.kind == "GUIDES" and len(c.vellus.layers)]
    return [guides for guides in found if not attributes.is_from_library(guides)]


def _update(guides, depsgraph):
    """Update guides; returns whether they moved. An error becomes their status."""
    try:
        is_moved = recording.update(guides, depsgraph)
    except HairError as error:
        guides.vellus.status = str(error)
        return False
    if is_moved:
        events.strands_computed(guides)
    return is_moved
