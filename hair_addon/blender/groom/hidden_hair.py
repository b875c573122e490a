# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair and guides that Blender's evaluation for viewports leaves out, since Vellus draws them.

In Material Preview EEVEE would draw them a second time, and Blender would deform all strands with each move of a
surface or a slider without showing them. Renders are never affected. Hair is shown before anything else may read it.
"""

from collections import defaultdict

import bpy
from bpy.types import Curves, Object

from ..data.strands import follow_nodes
from ..host import engines, running
from ..host.caches import Cache

# session_uid of Curves → True while all of their objects are hidden because their surface moves.
paused_cache = Cache()
# session_uid of Curves → True while all of their objects are hidden for another reason.
hidden_cache = Cache()


def is_any_paused() -> bool:
    """Whether any hair is hidden because its surface moves."""
    return len(paused_cache) > 0


def is_hidden(datablock: Curves) -> bool:
    """Whether objects of Curves are hidden."""
    uid = datablock.session_uid
    return paused_cache.get(uid) is not None or hidden_cache.get(uid) is not None


def pause(surfaces: set[Object]) -> None:
    """Hide hair and guides on moving surfaces, unless something other than Vellus may show or read them."""
    if not _may_hide_any():
        if is_any_paused():  # iterating over all objects is too slow for each frame
            resume()
        return
    if any(paused_cache.get(d.session_uid) and not _is_drawn_here(d) for d in bpy.data.hair_curves):
        resume()
        return
    moved = [d for d in bpy.data.hair_curves if d.surface in surfaces and paused_cache.get(d.session_uid) is None]
    if moved:
        _hide(moved, paused_cache, _users())


def resume() -> None:
    """Show hair and guides that are hidden only because their surface moves."""
    paused_cache.clear()
    _show_others()


def hide(datablocks: list[Curves]) -> None:
    """Hide Curves until `show`, unless something other than Vellus may show or read them; show those that it may."""
    if not _may_hide_any():
        show()
        return
    users, is_any_shown = _users(), False
    for datablock in datablocks:
        uid = datablock.session_uid
        if hidden_cache.get(uid) is not None and not (_is_drawn_here(datablock) and _may_hide(users[datablock])):
            hidden_cache.invalidate(uid)
            is_any_shown = True
    if is_any_shown:
        _show_others()
    _hide(datablocks, hidden_cache, users)


def show() -> None:
    """Show hair and guides that are not hidden because of a moving surface."""
    hidden_cache.clear()
    _show_others()


def show_all() -> None:
    """Show all hair and guides, also those hidden in a file or an undo step."""
    paused_cache.clear()
    show()


def _hide(datablocks, cache, users_of):
    for datablock in datablocks:
        if cache.get(datablock.session_uid) is not None or not _is_drawn_here(datablock):
            continue
        users = users_of[datablock]
        # Check all objects: some may be linked or have other nodes.
        if _may_hide(users) and (is_hidden(datablock) or not _are_read_by_others(users)):
            is_done = [follow_nodes.hide(user, True) for user in users]
            if any(is_done):
                cache.keep(datablock.session_uid, True)


def _show_others():
    """Show the objects of Curves that are in no cache."""
    for curves_object in bpy.data.objects:
        if curves_object.type == "CURVES" and follow_nodes.is_hidden(curves_object):
            if not is_hidden(curves_object.data):
                follow_nodes.hide(curves_object, False)


def _users():
    """Return {Curves: [objects]}, empty for Curves without objects."""
    found = defaultdict(list)
    for user in bpy.data.objects:
        if user.type == "CURVES":
            found[user.data].append(user)
    return found


def _may_hide_any():
    return running.has_window() and running.job() is None and not _is_read_elsewhere()


def _is_drawn_here(datablock):
    """Whether Blender does not draw Curves in viewports."""
    kind = datablock.vellus.kind
    return datablock.vellus.is_drawn if kind == "HAIR" else kind == "GUIDES" and not datablock.vellus.show_guides


def _may_hide(curves_objects):
    """Whether objects are neither displayed by Blender nor edited, and have no other active modifiers."""
    return all(map(_may_hide_object, curves_objects))


def _may_hide_object(curves_object):
    if curves_object.mode != "OBJECT" or curves_object.display_type != "BOUNDS":
        return False
    if curves_object.override_library is not None:
        return False  # a changed input would create a library override
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
