# SPDX-License-Identifier: GPL-3.0-or-later
"""bpy.app.handlers: what became stale, learned from depsgraph updates."""

import bpy
import numpy as np
from bpy.app.handlers import persistent

from . import bindings, hair_cache, keyed, live_hair, looks, pipeline, running, viewport
from . import curves as curves_door

# Guides as they were when their geometry was last reported: session_uid → (N, 3) points. Blender reports the geometry
# of Curves as updated when no more than their surface's place has changed.
_guide_points = {}

# Surfaces that somebody is painting an image on, by session_uid: Blender need not say so before they leave that mode.
_painted = set()

# Whether a window is about to evaluate a file that was just opened, which reports all of it as updated.
_is_opening = False

# Whether an undo or redo may have brought back guides without the hair that was written for them, or the reverse.
_is_undone = False


@persistent
def after_depsgraph_update(_scene, depsgraph):
    """Forget what changed on the GPU and make again what its settings or inputs have outdated."""
    if depsgraph.mode != "VIEWPORT":
        return
    global _is_opening, _is_undone
    viewport.forget(is_hair_only=_is_hair_only(depsgraph))
    if any(isinstance(update.id, bpy.types.Scene) for update in depsgraph.updates):
        looks.follow_selection(depsgraph.view_layer)
    if _is_opening:
        _is_opening = False
        return
    changed = [update.id.original for update in depsgraph.updates if update.is_updated_geometry]
    for surface_object in _deformed(depsgraph):
        hair_cache.forget_pose(surface_object)
        # Nobody is in the middle of editing or painting it: hair waits until they leave that mode.
        if surface_object.mode == "OBJECT":
            live_hair.follow_surface(surface_object, depsgraph, surface_object.data in changed)
    moved = [u.id.original for u in depsgraph.updates if u.is_updated_geometry or u.is_updated_transform]
    live_hair.follow_partings(moved, depsgraph)
    live_hair.remember_axes()
    if _is_undone:
        _is_undone = False
        for datablock in _of_kind("HAIR"):
            if datablock.vellus.is_live and live_hair.is_left_by_undo(datablock):
                datablock.vellus.is_stale = True
    _mark_painted({update.id.original for update in depsgraph.updates if isinstance(update.id, bpy.types.Image)})
    combed = []
    for datablock in changed:
        if isinstance(datablock, bpy.types.Curves):
            hair_cache.forget_unless_same(datablock)
            if datablock.vellus.kind == "GUIDES" and _has_moved(datablock):
                combed.append(datablock)
    bindings.is_reported()
    keyed.follow(depsgraph)
    _evaluate(depsgraph, combed)


def _is_hair_only(depsgraph):
    """Whether nothing but the geometry of Curves has changed: surfaces, lights and the world are as they were."""
    # Of what is hidden or shown Blender reports no datablock at all.
    return len(depsgraph.updates) > 0 and all(_are_curves(update) for update in depsgraph.updates)


def _are_curves(update):
    changed = update.id
    if isinstance(changed, bpy.types.Object):
        return changed.type == "CURVES" and not update.is_updated_transform
    return isinstance(changed, bpy.types.Curves)


def _deformed(depsgraph):
    """The mesh objects whose evaluated shape may have changed."""
    updated = [update.id.original for update in depsgraph.updates if update.is_updated_geometry]
    return {o for o in updated if isinstance(o, bpy.types.Object) and o.type == "MESH"}


def _mark_painted(images):
    """Mark guides as stale whose image was painted on: where it is as it was after all, they keep their roots."""
    names = {image.name for image in images}
    painting = set()
    for guides in _of_kind("GUIDES"):
        state, surface = guides.vellus, guides.surface
        if surface is None or not (state.is_live and state.guides.density_image):
            continue
        uid = surface.session_uid
        if surface.mode == "TEXTURE_PAINT":
            painting.add(uid)
        if state.guides.density_image in names or uid in _painted - painting:
            state.is_stale = True
    _painted.clear()
    _painted.update(painting)


def _has_moved(guide_curves):
    points = curves_door.read_points(guide_curves)
    before = _guide_points.get(guide_curves.session_uid)
    _guide_points[guide_curves.session_uid] = points
    return before is None or not np.array_equal(before, points)


def _of_kind(kind):
    return [curves for curves in bpy.data.hair_curves if curves.vellus.kind == kind]


def _evaluate(depsgraph, combed):
    """Guides first: hair follows what they become. While an operator computes, what is outdated waits for its end."""
    if running.job() is not None:
        for guides in combed:
            live_hair.mark_followers(guides)
        return
    for guides in _of_kind("GUIDES"):
        if guides.vellus.is_stale and guides.vellus.is_live and _is_surface_at_rest(guides):
            pipeline.evaluate(guides, depsgraph)
            hair_cache.forget(guides.session_uid)
            combed.append(guides)
    for hair in _of_kind("HAIR"):
        state = hair.vellus
        follows = state.guide_curves in combed
        if not (state.is_live and _is_surface_at_rest(hair)):
            state.is_stale = state.is_stale or follows
        elif state.is_stale and not live_hair.is_ahead(hair):
            live_hair.make_again(hair, depsgraph)
        elif follows:
            live_hair.follow_guides(hair, depsgraph)
        if state.is_shading_stale:
            looks.evaluate_shading(hair)


def _is_surface_at_rest(curves):
    """Whether nobody is in the middle of editing or painting the surface: hair waits until they leave that mode."""
    return curves.surface is None or curves.surface.mode == "OBJECT"


@persistent
def before_frame_change(_scene, _depsgraph):
    """Keep what hair is made of, to see what is keyed otherwise."""
    keyed.remember()


@persistent
def after_frame_change(scene, depsgraph):
    """Strands are carried to where their surfaces are in this frame; what is keyed is made again, in renders too."""
    if depsgraph.mode == "VIEWPORT":
        viewport.forget()
        for surface_object in _deformed(depsgraph):
            hair_cache.forget_pose(surface_object)
    if keyed.may_follow(scene, depsgraph) and keyed.follow(depsgraph):
        # A render may divide surfaces otherwise; hair is rooted on what the viewport shows.
        is_render = depsgraph.mode == "RENDER"
        _evaluate(bpy.context.evaluated_depsgraph_get() if is_render else depsgraph, [])
        if is_render:
            live_hair.write_all()


@persistent
def before_reading(*_args):
    """Somebody is about to read the hair's Curves: a file, a render."""
    live_hair.write_all()


@persistent
def after_load(*_args):
    """Hair in a file is as it was saved; without a window Blender reports nothing of it."""
    global _is_opening, _is_undone
    _is_opening = not bpy.app.background
    _is_undone = True  # a file that was saved in the middle of a stroke is no better off
    forget_everything()


@persistent
def after_undo(*_args):
    """Undo brings back what the file held, which may be guides without the hair that followed them."""
    global _is_undone
    _is_undone = True
    forget_everything()


@persistent
def forget_everything(*_args):
    """Undo, redo and a new file bring other data under the same names."""
    viewport.forget()
    live_hair.forget()
    hair_cache.clear()
    keyed.forget()
    _guide_points.clear()
    _painted.clear()


_HANDLERS = (
    (bpy.app.handlers.depsgraph_update_post, after_depsgraph_update),
    (bpy.app.handlers.frame_change_pre, before_frame_change),
    (bpy.app.handlers.frame_change_post, after_frame_change),
    (bpy.app.handlers.save_pre, before_reading),
    (bpy.app.handlers.render_init, before_reading),
    (bpy.app.handlers.undo_post, after_undo),
    (bpy.app.handlers.redo_post, after_undo),
    (bpy.app.handlers.load_post, after_load),
)


def register():
    """Listen to Blender."""
    for handlers, handler in _HANDLERS:
        handlers.append(handler)


def unregister():
    """Stop listening; what hair is ahead of its Curves is written first."""
    for handlers, handler in _HANDLERS:
        handlers.remove(handler)
    live_hair.write_all()
    live_hair.forget()
    keyed.forget()
    _guide_points.clear()
