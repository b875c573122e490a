# SPDX-License-Identifier: GPL-3.0-or-later
"""Pausing of Blender's deformation of hair and guides while their surface moves, as Vellus draws them itself.

While paused, evaluation for viewports leaves strands at rest; it resumes before anything else may read them. Renders
are never affected.
"""

import bpy
from bpy.types import Curves, Object

from ..data.strands import follow_nodes
from ..host import engines, running
from ..host.caches import Cache

paused_cache = Cache()  # session_uid of Curves → True while all of their objects may be paused


def is_any() -> bool:
    """Whether any hair is paused."""
    return len(paused_cache) > 0


def is_paused(datablock: Curves) -> bool:
    """Whether objects of Curves are paused."""
    return paused_cache.get(datablock.session_uid) is not None


def pause(surfaces: set[Object]) -> None:
    """Pause hair and guides on moving surfaces, unless something other than Vellus may show or read them."""
    if not running.has_window() or running.job() is not None or _is_read_elsewhere():
        if is_any():  # iterating over all objects is too slow for each frame
            resume()
        return
    for datablock in bpy.data.hair_curves:
        if is_paused(datablock):
            if not _is_drawn_here(datablock):
                resume()
                return
            continue
        if datablock.surface not in surfaces or not _is_drawn_here(datablock):
            continue
        users = [user for user in bpy.data.objects if user.type == "CURVES" and user.data == datablock]
        if all(map(_may_pause, users)) and not _are_read_by_others(users):
            # Check all objects: some may be linked or have other nodes.
            is_done = [follow_nodes.pause(user, True) for user in users]
            if any(is_done):
                paused_cache.keep(datablock.session_uid, True)


def resume() -> None:
    """Resume the deformation of all hair and guides, also of copies, and of those paused in a file or an undo step."""
    paused_cache.clear()
    for curves_object in bpy.data.objects:
        if curves_object.type == "CURVES" and follow_nodes.is_paused(curves_object):
            follow_nodes.pause(curves_object, False)


def _is_drawn_here(datablock):
    """Whether Blender does not draw Curves in viewports."""
    kind = datablock.vellus.kind
    return datablock.vellus.is_drawn if kind == "HAIR" else kind == "GUIDES" and not datablock.vellus.show_guides


def _may_pause(curves_object):
    """Whether an object is neither displayed by Blender nor edited, and has no other active modifiers."""
    if curves_object.mode != "OBJECT" or curves_object.display_type != "BOUNDS":
        return False
    if curves_object.override_library is not None:
        return False  # a paused input would create a library override
    following = follow_nodes.modifier_of(curves_object)
    return all(m == following or not m.show_viewport for m in curves_object.modifiers)


def _are_read_by_others(curves_objects):
    """Whether nodes, modifiers or constraints of other data refer to objects."""
    found = bpy.data.user_map(subset=set(curves_objects))
    holders = bpy.types.Collection | bpy.types.Scene | bpy.types.WindowManager | bpy.types.Screen
    return any(not isinstance(user, holders) for users in found.values() for user in users)


def _is_read_elsewhere():
    """Whether a window shows or edits Curves with Blender's own drawing, or a file browser may start an export."""
    for manager in bpy.data.window_managers:
        for window in manager.windows:
            active = window.view_layer.objects.active
            if active is not None and active.type == "CURVES" and active.mode != "OBJECT":
                return True
            if engines.shows_another(window):
                return True
            browsers = [area.spaces.active for area in window.screen.areas if area.type == "FILE_BROWSER"]
            if any(browser.active_operator is not None for browser in browsers):
                return True
    return False
