# SPDX-License-Identifier: GPL-3.0-or-later
"""bpy.app.handlers: what became stale, learned from depsgraph updates."""

import bpy
import numpy as np
from bpy.app.handlers import persistent

from . import curves as curves_door
from . import hair_cache, pipeline, viewport

# Guides as they were when their geometry was last reported: session_uid → (N, 3) points. Blender reports the geometry
# of Curves as updated when no more than their surface's place has changed.
_guide_points = {}

# Whether a window is about to evaluate a file that was just opened, which reports all of it as updated.
_is_opening = False


@persistent
def after_depsgraph_update(_scene, depsgraph):
    """Forget what changed on the GPU and make again what its settings or inputs have outdated."""
    if depsgraph.mode != "VIEWPORT":
        return
    global _is_opening
    viewport.forget()
    if _is_opening:
        _is_opening = False
        return
    changed = [update.id.original for update in depsgraph.updates if update.is_updated_geometry]
    for datablock in changed:
        if isinstance(datablock, bpy.types.Curves):
            hair_cache.forget(datablock.session_uid)
            if datablock.vellus.kind == "GUIDES" and _has_moved(datablock):
                _mark_followers(datablock)
        elif isinstance(datablock, bpy.types.Mesh):
            _mark_grown_on(datablock)
    _evaluate_stale(depsgraph)


def _has_moved(guide_curves):
    points = curves_door.read_points(guide_curves)
    before = _guide_points.get(guide_curves.session_uid)
    _guide_points[guide_curves.session_uid] = points
    return before is None or not np.array_equal(before, points)


def _mark_followers(guide_curves):
    for curves in bpy.data.hair_curves:
        if curves.vellus.guide_curves == guide_curves:
            curves.vellus.is_stale = True


def _mark_grown_on(mesh):
    for curves in bpy.data.hair_curves:
        if curves.surface is not None and curves.surface.data == mesh and curves.vellus.kind != "NONE":
            curves.vellus.is_stale = True


def _evaluate_stale(depsgraph):
    """Guides first: hair follows what they become."""
    for kind in ("GUIDES", "HAIR"):
        for curves in bpy.data.hair_curves:
            if curves.vellus.kind != kind:
                continue
            if curves.vellus.is_stale and curves.vellus.is_live and _is_surface_at_rest(curves):
                pipeline.evaluate(curves, depsgraph)
                hair_cache.forget(curves.session_uid)
                if kind == "GUIDES":
                    _mark_followers(curves)
            if curves.vellus.is_shading_stale:
                pipeline.evaluate_shading(curves)


def _is_surface_at_rest(curves):
    """Whether nobody is in the middle of editing or painting the surface: hair waits until they leave that mode."""
    return curves.surface is None or curves.surface.mode == "OBJECT"


@persistent
def after_load(*_args):
    """Hair in a file is as it was saved; without a window Blender reports nothing of it."""
    global _is_opening
    _is_opening = not bpy.app.background
    forget_everything()


@persistent
def forget_everything(*_args):
    """Undo, redo and a new file bring other data under the same names."""
    viewport.forget()
    hair_cache.clear()
    _guide_points.clear()


_HANDLERS = (
    (bpy.app.handlers.depsgraph_update_post, after_depsgraph_update),
    (bpy.app.handlers.undo_post, forget_everything),
    (bpy.app.handlers.redo_post, forget_everything),
    (bpy.app.handlers.load_post, after_load),
)


def register():
    """Listen to Blender."""
    for handlers, handler in _HANDLERS:
        handlers.append(handler)


def unregister():
    """Stop listening."""
    for handlers, handler in _HANDLERS:
        handlers.remove(handler)
    _guide_points.clear()
