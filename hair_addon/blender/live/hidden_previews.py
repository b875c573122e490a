# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair hidden from Blender's own drawing while Material Preview shows it, or while one of its sliders is dragged.

Vellus draws that hair. EEVEE would draw it once more, with its shadows, and Blender would evaluate the nodes of all
strands with each move of a slider. Hair is shown again before anything else may read it.
"""

import time

import bpy

from ..groom import hidden_hair
from ..host import running
from ..host.caches import Cache

_PERIOD = 0.25  # seconds between two checks of the windows
# Maximum seconds between two moves of one slider; software rendering takes long to draw a picture.
_TOGETHER = 4.0

_handles = []  # of the draw handler

# session_uid of hair Curves → `time.monotonic` of their last change.
changed_cache = Cache()


def register():
    """Check with every redraw of a viewport whether hair must be hidden."""
    _handles.append(bpy.types.SpaceView3D.draw_handler_add(look, (), "WINDOW", "POST_VIEW"))


def unregister():
    """Show all hair."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
    if bpy.app.timers.is_registered(follow):
        bpy.app.timers.unregister(follow)
    hidden_hair.show()


def look():
    """Draw handler: Blender's data cannot be changed while it draws, so a timer follows at once."""
    if bpy.context.space_data.shading.type == "MATERIAL":
        _begin()


def hair_changed(hair, is_seen):
    """Hide hair whose previous change was drawn by viewports a moment ago; is_seen: whether one has drawn it."""
    now, before = time.monotonic(), changed_cache.get(hair.session_uid)
    changed_cache.keep(hair.session_uid, now)
    if is_seen and before is not None and now - before < _TOGETHER:
        hidden_hair.hide([hair])
        _begin()


def follow():
    """Timer: hide and show hair as the windows ask; returns the seconds until the next look, or None for the last."""
    if _shows_preview():
        hidden_hair.hide(list(bpy.data.hair_curves))
        return _PERIOD
    rest = time.monotonic() - 2.0 * _PERIOD
    if any(moment > rest for moment in changed_cache.values()):
        return _PERIOD
    changed_cache.clear()
    hidden_hair.show()
    return None


def _begin():
    if running.has_window() and not bpy.app.timers.is_registered(follow):
        bpy.app.timers.register(follow, first_interval=0.0, persistent=True)


def _shows_preview():
    windows = (window for manager in bpy.data.window_managers for window in manager.windows)
    areas = (area for window in windows for area in window.screen.areas if area.type == "VIEW_3D")
    return any(area.spaces.active.shading.type == "MATERIAL" for area in areas)
