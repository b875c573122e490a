# SPDX-License-Identifier: GPL-3.0-or-later
"""Live hair: updates while guides are combed and masks are painted.

In a window the picture has priority: strands whose guides moved are recomputed and uploaded, and so are looks from
painted maps. The hair's Curves are written at the end of the interaction, or before they are read. Without a window
and in updates by scripts, which may read the Curves next, they are written at once.
"""

import sys

import bpy

from ...core.errors import HairError
from ..data import surface_space
from ..data.maps import strand_maps
from ..data.strands import curves, simulated_guides
from ..groom import (
    bindings,
    changed_weights,
    hair_outside,
    mapped_wetness,
    pipeline,
    size_fitting,
    staleness,
    styled_hair,
    varied_strands,
    writing,
)
from ..groom.foreign import kept_following, kept_thickness
from ..groom.styles import painted_masks
from ..host import running
from ..host.notices import text_of
from ..materials import looks
from ..render import hair_cache, modified_hair
from ..settings import style_items
from . import events


def follow(hair, depsgraph, local=None):
    """Let kept hair follow its guides; returns whether the guides have changed. An error becomes its status.

    local: (N, 3) current points of the guides, if they have been read already.
    """
    try:
        is_other = kept_following.follow(hair, depsgraph, local)
    except HairError as error:
        bindings.kept_cache.invalidate(hair.session_uid)
        hair.vellus.status = str(error)
        hair.vellus.is_stale = False
        return True
    if is_other:
        events.strands_computed(hair)
    return is_other


# Seconds without a change after which an interaction is over, unless its operator still runs.
_PAUSE = 0.3

# Name prefixes of operators that move guides while a mouse button is held.
_STROKES = ("SCULPT_CURVES_OT_", "CURVES_OT_", "TRANSFORM_OT_")


def follow_guides(hair, depsgraph, local=None):
    """Update a hair's strands after combing; guides are only searched if some were added, removed or slid.

    local: (N, 3) current points of the guides, if they have been read already.
    """
    if curves.is_hand_made(hair):
        follow(hair, depsgraph, local)
        return
    bound = bindings.of(hair)
    if bound is None:
        is_simulated = simulated_guides.is_shown(hair.vellus.guide_curves)
        if hair.vellus.followed and not is_simulated and not staleness.is_left_by_undo(hair):
            return  # was written for these guides, in another session or before an undo
        regenerate(hair, depsgraph)
        return
    try:
        guides = _shown_guides(hair, bound, local)
        is_made = hair_cache.may_make(hair.session_uid) and not hair_outside.is_wanted(hair)
        moved = bound.follow_on_gpu(guides) if is_made else bound.follow(guides)
    except HairError as error:
        hair.vellus.status = str(error)
        return
    if moved is None:
        regenerate(hair, depsgraph)
    elif len(moved):
        if is_made:
            hair_cache.follow_where_drawn(hair.session_uid, bound.shown)
        else:
            hair_cache.move(hair.session_uid, moved, bound.shown)
        write_soon(hair)
    elif hair_outside.is_wanted(hair):
        bound.is_due()  # colliders may have moved
        write_soon(hair)


def show_guides(guides, points, depsgraph):
    """Show guides at (G, POINT_COUNT, 3) simulated points like `simulated_guides.show`, and let their hair follow."""
    simulated_guides.show(guides, points)
    events.strands_computed(guides)
    for hair in curves.followers(guides):
        if hair.vellus.is_live:
            follow_guides(hair, depsgraph)


def show_styles(depsgraph):
    """Show hair with its styles; without styles while its guides are combed, if that is set."""
    for hair in bpy.data.hair_curves:
        state = hair.vellus
        if state.kind != "HAIR":
            continue
        is_styled, bound = not _is_combed_straight(state), bindings.of(hair)
        if bound is None and not is_styled and state.is_live and not text_of(state, "status"):
            regenerate(hair, depsgraph)  # as the first stroke would; a refusal sets the status, so not again
            bound = bindings.of(hair)
        if bound is not None and is_styled != (bound.straight is None):
            bound.show_styles(is_styled)
            events.strands_computed(hair)


def _is_combed_straight(state):
    """Whether hair is shown without its styles because its guides are in Sculpt Mode."""
    guides = state.guide_curves
    if guides is None or guides.vellus.shows_styles_while_combing or not len(state.styles) or not running.has_window():
        return False
    return any(o.mode == "SCULPT_CURVES" and o.data == guides for o in bpy.data.objects)


def regenerate(hair, depsgraph):
    """Bind hair to its guides again and compute all strands, after changes of settings, surface or guides."""
    if curves.follows_library(hair) and simulated_guides.is_shown(hair.vellus.guide_curves):
        _follow_linked(hair, depsgraph)
        return
    if curves.is_hand_made(hair) and _follow_kept(hair, depsgraph):
        return
    if not running.has_window():
        pipeline.evaluate(hair, depsgraph)
        if _follow_simulated(hair):
            _write(hair)
        events.strands_computed(hair)
        _guides_written(hair)
        return
    try:
        curves.require_not_linked(hair)
        guide_curves, settings = pipeline.inputs_of(hair)
        known = bindings.of(hair)
        if known is None or known.is_written:
            pipeline.require_uncombed(hair)
        if _restyle(hair, depsgraph):
            return
        if hair_cache.may_make(hair.session_uid) and _is_reweighed(hair, depsgraph):
            return
        bound = pipeline.bind_hair(guide_curves, settings, depsgraph, hair)
        writing.require_count(hair, len(bound.binding.positions), settings.point_count)
        bindings.keep(hair, bound)
        size_fitting.show(hair, bound.settings, bound.fits)
        _follow_simulated(hair)
    except HairError as error:
        hair.vellus.is_stale = hair.surface is not None and surface_space.is_flattened(hair.surface)
        hair.vellus.status = str(error)
        return
    events.strands_computed(hair)
    write_soon(hair)


def _follow_kept(hair, depsgraph):
    """Let kept hair follow its guides and the maps of its thickness and wetness; returns whether any has changed it."""
    has_moved = follow(hair, depsgraph)
    if has_moved and hair.vellus.status:  # it cannot follow
        return True
    is_thickened = kept_thickness.follow(hair)
    is_soaked = mapped_wetness.follow_kept(hair, hair.vellus.status if is_thickened else "")
    if not (is_thickened or is_soaked):
        return has_moved
    events.strands_computed(hair)
    return True


def _is_reweighed(hair, depsgraph):
    """Show hair with new guide weights, lengths or radii; returns False if anything else has changed."""
    bound = None if hair_outside.is_wanted(hair) else changed_weights.rebound(hair, depsgraph)
    if bound is None:
        return False
    varied_strands.apply(hair, bound)
    bindings.keep(hair, bound)
    hair_cache.follow_where_drawn(hair.session_uid, bound)
    write_soon(hair)
    return True


def _follow_linked(hair, depsgraph):
    """Let hair of a library, or hair between its guides, follow simulated guides: only points are written."""
    try:
        pipeline.require_uncombed(hair)
        bound = pipeline.bind_hair(*pipeline.inputs_of(hair), depsgraph, hair)
        fits = writing.fits(hair, bound)
    except HairError as error:
        hair.vellus.is_stale = False
        hair.vellus.status = str(error)
        return
    bound.is_written = bound.has_moved_only = bound.is_map_written = fits  # the library's file holds the rest
    bindings.keep(hair, bound)
    _follow_simulated(hair)
    events.strands_computed(hair)
    write_soon(hair)


def _follow_simulated(hair):
    """Let hair that was bound to combed guides follow their simulated points; returns whether there are any."""
    bound = bindings.of(hair)
    if bound is None or not simulated_guides.is_shown(hair.vellus.guide_curves):
        return False
    bound.follow(_shown_guides(hair, bound))
    return True


def _shown_guides(hair, bound, local=None):
    device = bound.binding.positions.device
    return curves.read_shown_guides(hair.vellus.guide_curves, bound.surface, device, bound.guides, local)


def _restyle(hair, depsgraph):
    """Show and soon write the result of `pipeline.restyle`; returns whether it applies."""

    def is_drawn(bound, styles):
        return hair_cache.may_restyle(hair.session_uid, bound, styles) and not hair_outside.is_wanted(hair)

    if not pipeline.restyle(hair, depsgraph, is_drawn):
        return False
    bound = bindings.of(hair)
    if bound.is_written:  # with the same styles as before
        hair.vellus.is_stale = False
    else:
        if bound.is_behind and bound.straight is None:
            hair_cache.follow_where_drawn(hair.session_uid, bound)
        else:
            events.strands_computed(hair)
        write_soon(hair)
    return True


def is_ahead(hair):
    """Whether stale hair has been regenerated already, and only needs to be written."""
    bound = bindings.of(hair)
    if bound is None or bound.is_written or bound.has_moved_only or hair.vellus.guide_curves is None:
        return False
    try:
        guide_curves, settings = pipeline.inputs_of(hair)
        styles = style_items.styles_of(hair.vellus)
    except HairError:
        return False  # `regenerate` handles it
    if bound.settings != settings or bound.guide_uid != guide_curves.session_uid:
        return False
    return (
        varied_strands.is_same(hair, bound)
        and bound.styles.read.styles == styles
        and bound.styles.read.has_maps(*styled_hair.read_maps(hair, guide_curves.surface, bound.surface, styles))
    )


def write_all(*_args):
    """Write all hair that is newer than its datablock: at the end of an interaction, or before it is read.

    Hair whose settings have changed since is left to the next evaluation, as writing stores the former settings.
    """
    if _write_newer():
        cancel_writing()


def _write_newer():
    """Write hair that is newer than its datablock; returns whether none is left to the next evaluation."""
    is_complete = True
    for hair in bpy.data.hair_curves:
        bound = bindings.of(hair)
        if bound is not None and not bound.is_written:
            if hair.vellus.is_stale and _has_other_settings(hair, bound):
                is_complete = False
            else:
                _write(hair)
        strand_maps.write_pending(hair)
    return is_complete


def _has_other_settings(hair, bound):
    """Whether settings have changed since hair was bound. A script of a timer may change them between two updates."""
    try:
        _guide_curves, settings = pipeline.inputs_of(hair)
        return bound.settings != settings or bound.styles.read.styles != style_items.styles_of(hair.vellus)
    except HairError:
        return False  # `regenerate` handles it


def _write(hair):
    """Write hair that is newer than its datablock. An error becomes its status, so that other hair is written."""
    try:
        writing.write_hair(hair)
        modified_hair.invalidate_users(hair)  # the next evaluation has them, which may come without a report
        _guides_written(hair)
        bound = bindings.of(hair)
        if bound is not None and bound.free is not None:
            events.strands_computed(hair)  # some strands were moved out of colliders
    except HairError as error:
        bindings.invalidate(hair)
        hair.vellus.status = str(error)
        print(f"Vellus: {error}", file=sys.stderr)


def _guides_written(hair):
    """Draw guides at the roots that were stored with their hair; Blender reports these only in its next update."""
    if hair.vellus.guide_curves is not None:
        events.curves_reported(hair.vellus.guide_curves)


def cancel_writing():
    """Drop pending writes after undo, redo and a new file."""
    if bpy.app.timers.is_registered(write_after_pause):
        bpy.app.timers.unregister(write_after_pause)


def write_soon(hair):
    """Write hair after a pause in which nothing changes; at once for scripts, or if modifiers take its strands."""
    if not running.may_wait() or _is_drawn_modified(hair):
        _write(hair)
        return
    _begin_pause()


def evaluate_shading(hair):
    """Update the look of hair. In a window, looks from maps are written after a pause if Vellus draws the hair."""
    is_soon = running.may_wait() and hair.vellus.is_drawn and not _is_drawn_modified(hair)
    looks.evaluate_shading(hair, is_soon)
    if strand_maps.is_pending(hair):
        _begin_pause()
    events.looks_written(hair)


def _begin_pause():
    cancel_writing()  # restarts the pause with every change: a stroke consists of many
    bpy.app.timers.register(write_after_pause, first_interval=_PAUSE, persistent=True)


def _is_drawn_modified(hair):
    """Whether viewports have drawn hair with modifiers of the artist."""
    return any(known.datablock == hair.session_uid for known in modified_hair.modified_cache.values())


def write_after_pause():
    """Timer: write hair unless a stroke is running; returns the seconds until the next try, or None."""
    if is_stroke_running():
        return _PAUSE
    if not _write_newer():
        return _PAUSE
    cancel_writing()
    return None


def is_stroke_running():
    """Whether a modal operator moves guides in any window."""
    return running.is_running(_STROKES)


def follow_masks(surfaces, depsgraph):
    """Style hair again while masks of its styles are painted, or if settings of its styles change meanwhile.

    surfaces: changed mesh objects in a paint mode. Roots wait until the mode is left.
    """
    for hair in bpy.data.hair_curves:
        state = hair.vellus
        if state.kind != "HAIR" or not state.is_live or hair.surface is None:
            continue
        if not _is_painted(hair, surfaces) and not _is_set_while_painting(hair):
            continue
        try:
            if bindings.of(hair) is None:
                if not staleness.has_other_mask(hair, depsgraph):
                    regenerate(hair, depsgraph)
            elif _restyle(hair, depsgraph):
                state.status = bindings.of(hair).map_status
        except HairError as error:
            state.status = str(error)


def _is_painted(hair, surfaces):
    return curves.grown_on(hair) in surfaces and style_items.have_masks(hair.vellus)


def _is_set_while_painting(hair):
    return hair.vellus.is_stale and curves.grown_on(hair).mode in painted_masks.PAINT_MODES and not is_ahead(hair)


def update_once(parts, view_layer):
    """Update Curves as if Auto Update were on for a moment; parts with Auto Update stay as they are."""
    waiting = [part for part in parts if not part.vellus.is_live]
    try:
        for part in waiting:
            part.vellus.is_live = True
            part.vellus.is_stale = part.vellus.is_stale and not curves.is_combed(part)
            part.update_tag()
            if part.surface is not None and part.surface.data is not None:
                part.surface.data.update_tag()  # the mesh may have been edited meanwhile
        view_layer.update()
        write_all()
    finally:
        for part in waiting:
            part.vellus.is_live = False
