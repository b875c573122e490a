# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluation of outdated guides and hair: guides first, then their hair."""

import contextlib

import bpy

from ..data import usable_surfaces
from ..data.strands import curves
from ..groom import pipeline, staleness
from ..host import memory, running
from ..materials import looks
from . import events, flattened_surfaces, live_hair, live_layers, stale_marks

# UIDs of Curves that are evaluated now: an update meanwhile must not begin again.
_evaluated = set()


def of_kind(kind):
    """Return the Curves of a kind: "GUIDES" or "HAIR"."""
    return [curves for curves in bpy.data.hair_curves if curves.vellus.kind == kind]


def evaluate(depsgraph, combed):
    """Evaluate guides first, then their hair. During a long operation, updates wait for its end.

    combed: {guide Curves that have moved: their (N, 3) points}.
    """
    if running.job() is not None:
        for guides in combed:
            stale_marks.mark_followers(guides)
        return
    # Callbacks run last to first. An unexpected error is raised after all of them, so that it stops no other hair.
    with contextlib.ExitStack() as stack:
        # In a window hair that needs much memory waits for an operator; a render must not lack hair.
        stack.enter_context(memory.asking(running.has_window() and not running.is_rendering()))
        stack.callback(live_hair.show_styles, depsgraph)
        for hair in reversed(of_kind("HAIR")):
            stack.callback(_evaluate_hair, hair, depsgraph, combed)
        for guides in reversed(of_kind("GUIDES")):
            stack.callback(_evaluate_guides, guides, depsgraph, combed)
        stack.callback(live_layers.follow, combed, depsgraph)


@contextlib.contextmanager
def _once(datablock):
    """Leave Curves out of updates during their evaluation."""
    uid = datablock.session_uid
    _evaluated.add(uid)
    try:
        yield
    finally:
        _evaluated.discard(uid)


def _evaluate_guides(guides, depsgraph, combed):
    if guides.session_uid in _evaluated:
        return
    if guides.vellus.is_shading_stale:
        looks.evaluate_guides(guides)
    if guides.vellus.is_stale and guides.vellus.is_live and _is_ready(guides, depsgraph):
        if flattened_surfaces.is_waiting(guides):
            return
        with _once(guides):
            pipeline.evaluate(guides, depsgraph)
        events.strands_computed(guides)
        stale_marks.follow_mask(guides, depsgraph)
        combed[guides] = None  # to be read


def _evaluate_hair(hair, depsgraph, combed):
    if hair.session_uid in _evaluated:
        return
    state = hair.vellus
    follows = state.guide_curves in combed
    if not (state.is_live and _is_ready(hair, depsgraph)):
        # Guides that are reported for the first time may be the guides that the hair was made with.
        state.is_stale = state.is_stale or (follows and staleness.is_left_by_undo(hair))
    elif state.is_stale and flattened_surfaces.is_waiting(hair):
        pass
    elif state.is_stale and not live_hair.is_ahead(hair):
        with _once(hair):
            live_hair.regenerate(hair, depsgraph)
    elif follows:
        live_hair.follow_guides(hair, depsgraph, combed[state.guide_curves])
    if state.is_shading_stale:
        live_hair.evaluate_shading(hair)


def _is_ready(datablock, depsgraph):
    """Whether the surface is missing, or in Object Mode and evaluated; the surface of the guides also in Object Mode.

    Hair waits until edit and paint modes are left, and hair of another scene until that scene is evaluated.
    """
    surface, grown_on = datablock.surface, curves.grown_on(datablock)
    if grown_on is not None and grown_on.mode != "OBJECT":
        return False
    return surface is None or (surface.mode == "OBJECT" and usable_surfaces.is_in(surface, depsgraph))


def evaluate_other_scenes(scene):
    """Regenerate outdated hair of scenes that are not shown: their updates call `handlers.after_depsgraph_update`."""
    if scene != bpy.context.scene or len(bpy.data.scenes) == 1:
        return
    outdated = {c.surface for c in bpy.data.hair_curves if c.vellus.is_stale and c.vellus.is_live} - {None}
    for surface_object in outdated:
        scenes = surface_object.users_scene
        layers = [] if scene in scenes else [layer for its in scenes for layer in its.view_layers]
        layer = next((layer for layer in layers if surface_object.name in layer.objects), None)
        if layer is not None:
            layer.update()
