# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that follows its guides while they are combed, and its surface while it is edited.

In a window the picture goes first: strands whose guides moved are computed again and uploaded, and the hair's Curves
are written when the interaction is over, or before somebody else reads them. Without a window nobody waits for a
picture, and the Curves are written at once.
"""

import bpy
import numpy as np

from ..core import hair_binding
from ..core.errors import HairError
from . import bindings, curves, edited_surfaces, hair_cache, pipeline

# Seconds without a change after which an interaction is over, unless its operator still runs.
_PAUSE = 0.3

# How the names of operators begin that move guides while a mouse button is held.
_STROKES = ("SCULPT_CURVES_OT_", "CURVES_OT_", "TRANSFORM_OT_")

# session_uid of a surface → (3, 3) local coordinates to world axes, after the last update.
_axes = {}


def has_window():
    """Whether somebody watches a picture, and timers run."""
    return not bpy.app.background


def follow_guides(hair, depsgraph):
    """Let a hair's strands follow guides that were combed: no search, unless guides came, went or slid."""
    if bindings.of(hair) is None:
        if hair.vellus.followed and not is_left_by_undo(hair):
            return  # written for these guides, in another session or before an undo
        make_again(hair, depsgraph)
        return
    try:
        moved = _follow_combed(hair)
    except HairError as error:
        hair.vellus.status = str(error)
        return
    if moved is None:
        make_again(hair, depsgraph)
    elif len(moved):
        hair_cache.move(hair.session_uid, moved)
        _write_soon(hair)


def _follow_combed(hair):
    """Move the strands of bound hair whose guides were combed since; indices (M,) of those that moved.

    None where that is not enough: guides came, went or slid over the surface, and the hair has to be bound again.
    """
    bound = bindings.of(hair)
    guides, before = pipeline.read_guides(hair.vellus.guide_curves, bound.surface), bound.guides
    if guides.points.shape != before.points.shape or not guides.roots.is_same(before.roots):
        return None
    combed = np.flatnonzero((guides.numpy() != before.numpy()).any(axis=(1, 2)))
    bound.guides = guides
    moved = np.arange(len(bound.shares)) if len(combed) == len(guides) else bound.reach.of(combed)
    if len(moved):
        # Beyond a half, to sort out those that stay would take longer.
        follow_bound(bound, moved if len(moved) <= len(bound.shares) // 2 else None)
        bound.has_moved_only = bound.is_written or bound.has_moved_only
        bound.is_written = False
    return moved


def follow_bound(bound, moved):
    """Bring strands of bound hair up to its guides; moved: (M,) indices of those to compute, None: all."""
    binding, guides, surface = bound.binding, bound.guides, bound.surface
    weights = hair_binding.weights_now(binding, guides, moved)
    if moved is None:
        bound.growing = hair_binding.growing_points(binding, guides, weights, surface.put_local, bound.points)
        bound.take_shares(weights.weights.numpy())
    else:
        points = hair_binding.follow_some(binding, guides, moved, weights)
        bound.points[moved] = surface.to_local(points, in_place=True)
        bound.take_shares(weights.weights.numpy(), moved)


def make_again(hair, depsgraph):
    """Bind hair to its guides again and compute every strand: another setting, another surface, other guides."""
    if not has_window():
        pipeline.evaluate(hair, depsgraph)
        hair_cache.forget(hair.session_uid)
        return
    try:
        curves.require_editable(hair)
        guide_curves, settings = pipeline.inputs_of(hair)
        known = bindings.of(hair)
        if known is None or known.is_written:
            pipeline.require_uncombed(hair)
        bindings.keep(hair, pipeline.bind_hair(guide_curves, settings, depsgraph, hair))
    except HairError as error:
        hair.vellus.is_stale = False
        hair.vellus.status = str(error)
        return
    hair_cache.forget(hair.session_uid)
    _write_soon(hair)


def is_ahead(hair):
    """Whether hair that is marked stale has been made again already, and only waits to be written."""
    bound = bindings.of(hair)
    if bound is None or bound.is_written or bound.has_moved_only or hair.vellus.guide_curves is None:
        return False
    try:
        guide_curves, settings = pipeline.inputs_of(hair)
    except HairError:
        return False  # it is `make_again` that says so
    return bound.settings == settings and bound.guide_uid == guide_curves.session_uid


def is_left_by_undo(hair):
    """Whether hair was written for other guides than are there now: undo may bring back one and not the other."""
    followed = hair.vellus.followed
    return followed != "" and followed != pipeline.guides_digest(hair.vellus.guide_curves)


def write_all(*_args):
    """Write all hair that is ahead of its datablock: an interaction is over, or somebody is about to read it."""
    if bpy.app.timers.is_registered(write_after_pause):
        bpy.app.timers.unregister(write_after_pause)
    for hair in bpy.data.hair_curves:
        bound = bindings.of(hair)
        if bound is not None and not bound.is_written:
            pipeline.write_hair(hair)


def forget():
    """Undo, redo and a new file bring other data: what waited to be written belonged to the old."""
    if bpy.app.timers.is_registered(write_after_pause):
        bpy.app.timers.unregister(write_after_pause)
    bindings.clear()
    _axes.clear()


def _write_soon(hair):
    if not has_window():
        pipeline.write_hair(hair)
        return
    # Put off with every change: a stroke brings many.
    if bpy.app.timers.is_registered(write_after_pause):
        bpy.app.timers.unregister(write_after_pause)
    bpy.app.timers.register(write_after_pause, first_interval=_PAUSE, persistent=True)


def write_after_pause():
    """For `bpy.app.timers`: write once nothing has changed for a while; seconds until the next try, or None."""
    if is_stroke_running():
        return _PAUSE
    write_all()
    return None


def is_stroke_running():
    """Whether an operator holds on to guides, in any window."""
    windows = (window for manager in bpy.data.window_managers for window in manager.windows)
    return any(o.bl_idname.startswith(_STROKES) for window in windows for o in window.modal_operators)


def remember_axes():
    """Keep how surfaces stand in the world: when a rotation or a scale is applied, nobody says what it was."""
    _axes.clear()
    for datablock in bpy.data.hair_curves:
        if datablock.surface is not None:
            axes = datablock.surface.matrix_world.to_3x3()
            _axes[datablock.surface.session_uid] = np.array(axes, np.float64)


def follow_surface(surface_object, depsgraph, is_mesh_edited):
    """Carry the guides of a surface whose shape may have been edited, and let the hair between them follow.

    is_mesh_edited: whether its mesh has changed, not modifiers alone, so that its weights may have too.
    """
    axes_before = _axes.get(surface_object.session_uid)
    for guides in bpy.data.hair_curves:
        state = guides.vellus
        if guides.surface != surface_object or state.kind != "GUIDES" or not state.is_live:
            continue
        try:
            curves.require_editable(guides)
            was_edited = edited_surfaces.follow_surface(guides, depsgraph, axes_before)
            if is_mesh_edited and not was_edited and pipeline.has_other_density(guides, depsgraph):
                state.is_stale = True
        except HairError as error:
            state.status = str(error)
            continue
        if was_edited:
            hair_cache.forget(guides.session_uid)
            mark_followers(guides)
    for hair in bpy.data.hair_curves if is_mesh_edited else ():
        state = hair.vellus
        if hair.surface != surface_object or state.kind != "HAIR" or not state.is_live:
            continue
        try:
            if pipeline.has_other_density(hair, depsgraph) or pipeline.has_other_parting(hair, depsgraph):
                _mark(hair)
        except HairError as error:
            state.status = str(error)


def follow_partings(changed, depsgraph):
    """Mark hair whose part lines, or whose guides' regions, are among some datablocks and are others than they were."""
    for hair in bpy.data.hair_curves:
        state = hair.vellus
        if state.kind != "HAIR" or not state.is_live or not _parts_by(state, changed):
            continue
        try:
            if pipeline.has_other_parting(hair, depsgraph):
                _mark(hair)
        except HairError as error:
            state.status = str(error)


def _parts_by(state, changed):
    lines = bpy.data.objects.get(state.hair.part_lines) if state.hair.part_lines else None
    if lines is not None and (lines in changed or lines.data in changed):
        return True
    # Read with each step of a stroke: so only where guides have regions of their own.
    guides = state.guide_curves
    return guides is not None and guides in changed and state.hair.region_attribute in guides.attributes


def mark_followers(guide_curves):
    """Mark all hair between some guides as stale."""
    for hair in curves.followers(guide_curves):
        _mark(hair)


def _mark(hair):
    """Mark hair as stale, even if it was made again since it was written."""
    bindings.forget(hair)
    hair.vellus.is_stale = True
