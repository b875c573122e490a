# SPDX-License-Identifier: GPL-3.0-or-later
"""Combing of guides becomes their active layer, and changed weights become points.

Guides store a fingerprint of the points that their layers give. Points with another one were edited: by brushes, in
Edit Mode, by guide tools or scripts.
"""

from dataclasses import replace

import numpy as np
from bpy.types import Curves, Depsgraph

from ...core import geometry
from ...core.errors import HairError
from ...core.geometry import mesh as mesh_math
from ...core.grooming import guide_layers
from ...core.grooming.guide_layers import GuideLayers
from ..data import scene
from ..data.strands import attributes, curves, layer_attributes
from ..host.caches import Cache
from ..host.notices import text_of
from ..settings import layer_items

_LEAST_PAINT = 1e-5  # smaller changes of masks are rounding

shape_cache = Cache(capacity=4)  # fingerprint → (N, 3) points that layers give


def is_outdated(guides: Curves) -> bool:
    """Whether guides were edited, or their weights changed, since they were composed."""
    state = guides.vellus
    if not len(state.layers) or attributes.is_from_library(guides):
        return False
    return layer_items.is_reweighed(state) or is_edited(guides)


def is_edited(guides: Curves, points: np.ndarray | None = None) -> bool:
    """Whether points (N, 3) of guides, read if they are not given, differ from what their layers give."""
    points = curves.read_points(guides) if points is None else points
    return guides.vellus.layered != geometry.fingerprint.fingerprint(points)


def update(guides: Curves, depsgraph: Depsgraph) -> bool:
    """Record edited points in the active layer, and compose guides with their present weights.

    Returns whether points were written. Points that the active layer cannot have, because it is hidden or has no weight
    there, return to where layers put them; the reason becomes the status of the guides.
    """
    state = guides.vellus
    if not len(state.layers) or attributes.is_from_library(guides):
        return False
    points = curves.read_points(guides)
    fingerprint = geometry.fingerprint.fingerprint(points)
    is_combed = state.layered != fingerprint
    if not is_combed and not layer_items.is_reweighed(state):
        return False
    had_status = bool(state.status)
    state.status = ""
    shown, weights = None, _weights(guides, depsgraph, is_shown=True)
    layers = layer_attributes.in_place(guides, layer_items.identities_of(state), weights)
    if is_combed and np.isfinite(points).all():
        shape = _shape(guides, layers)
        is_other = guide_layers.is_other(layers, points, shape)
        before, (layers, is_made, refusal) = layers, _recorded(layers, state, points, shape, is_other)
        is_other &= ~is_made
        shape = guide_layers.composed_again(layers, shape, is_other)
        shown = _shown(points, shape, layers.counts, guide_layers.is_other(layers, points, shape, is_other))
        if had_status:
            read(guides, depsgraph)  # reports masks that are still missing
        state.status = " ".join(sentence for sentence in (refusal, state.status) if sentence)
        _write(guides, layers, before)
    if layer_items.is_reweighed(state):
        layers = read(guides, depsgraph)
        note_shown(guides, depsgraph)
        return show(guides, guide_layers.composed(layers))
    if shown is None:
        return show_layers(guides, layers)
    if shown is points:
        _note(guides, points, fingerprint)
        return False
    return show(guides, shown)


def _shown(points, shape, counts, is_other):
    """Return points (N, 3) with those of a shape (N, 3) for chosen guides (G,); `points` itself if none is chosen."""
    if not is_other.any():
        return points
    shown, of_chosen = points.copy(), np.repeat(is_other, counts)
    shown[of_chosen] = shape[of_chosen]
    return shown


def _write(guides, layers, before):
    """Write layers after the active one was recorded; the others have changed only if the base or frames have."""
    state = guides.vellus
    identities = layer_items.identities_of(state)
    if layers.base is not before.base or layers.normals is not before.normals:
        layer_attributes.write(guides, layers, identities)
    elif state.active_layer < len(identities):
        layer_attributes.write_layer(guides, layers, identities[state.active_layer], state.active_layer)


def _shape(guides, layers):
    """Return the points (N, 3) that layers gave when guides were composed."""
    shape = shape_cache.get(guides.vellus.layered)
    return shape if shape is not None and len(shape) == len(layers.base) else guide_layers.composed(layers)


def _recorded(layers, state, points, shape, is_other):
    """Return (`GuideLayers` with edited points in the active layer, (G,) bool: guides that the layers reproduce,
    refusal or an empty text).

    is_other: (G,), guides whose points differ from the shape (N, 3).
    """
    refusal, place = "", state.active_layer
    try:
        layer_items.require_combable(state)
    except HairError as error:
        refusal = str(error)
    if refusal or place >= len(layers.turns):
        # Guides that were added, and roots that were moved, are still followed.
        weights = layers.weights.copy()
        weights[0] = 0.0
        found, is_made = guide_layers.recorded(layers.weighted(weights), 0, points)
        return replace(found, weights=layers.weights), is_made, refusal
    return *guide_layers.recorded(layers, place, points, shape, is_other, in_place=True), refusal


def show_layers(guides: Curves, layers: GuideLayers) -> bool:
    """Write what layers give to guides that differ from it; others keep their exact points. Returns as `show`."""
    shape, points = guide_layers.composed(layers), curves.read_points(guides)
    return show(guides, _shown(points, shape, layers.counts, guide_layers.is_other(layers, points, shape)))


def show(guides: Curves, shape: np.ndarray) -> bool:
    """Write points (N, 3) that layers give, if they differ; returns whether they do."""
    is_other = not np.array_equal(shape, curves.read_points(guides))
    if is_other:
        attributes.write(guides, "position", "FLOAT_VECTOR", "POINT", shape)
        guides.update_tag()
    note_shape(guides)
    return is_other


def note_shape(guides: Curves) -> None:
    """Note that layers give the present points; settings of guides still apply to the base unless it was edited."""
    points = curves.read_points(guides)
    _note(guides, points, geometry.fingerprint.fingerprint(points))


def _note(guides, points, fingerprint):
    """Note that layers give the present points (N, 3) with a fingerprint."""
    state = guides.vellus
    state.layered = fingerprint
    shape_cache.keep(fingerprint, points)
    if state.is_base_grown and not curves.is_hand_made(guides):
        state.written = state.layered


def read(guides: Curves, depsgraph: Depsgraph) -> GuideLayers:
    """Return the `GuideLayers` of guides with their weights."""
    weights = _weights(guides, depsgraph)
    return layer_attributes.read(guides, layer_items.identities_of(guides.vellus), weights)


def _weights(guides, depsgraph, is_shown=False):
    """Return the weights (L, G) float32 of layers; is_shown: weights of the present points."""
    state = guides.vellus
    weights = np.zeros((len(state.layers), len(guides.curves)), np.float32)
    for row, item in zip(weights, state.layers, strict=True):
        weight, name = (item.shown_weight, text_of(item, "shown_mask")) if is_shown else layer_items.wanted(item)
        row[:] = weight
        if not (name and weight):
            continue
        mask = layer_attributes.read_mask(guides, item.identity) if is_shown else None
        if mask is None:
            mask = _mask(guides, item.identity, name, depsgraph)
        row *= mask
    return weights


def note_shown(guides: Curves, depsgraph: Depsgraph) -> None:
    """Note that guides are composed with the present weights and masks, which are stored with their points."""
    layer_items.note_shown(guides.vellus)
    for item in guides.vellus.layers:
        name, mask = text_of(item, "shown_mask"), None
        if name:
            mask = _mask(guides, item.identity, name, depsgraph)
        layer_attributes.write_mask(guides, item.identity, mask)


def mark_painted(guides: Curves, depsgraph: Depsgraph) -> None:
    """Mark layers whose masks were painted since guides were composed."""
    for item in guides.vellus.layers:
        name = text_of(item, "shown_mask")
        shown = layer_attributes.read_mask(guides, item.identity) if name else None
        if shown is not None and not item.is_painted:
            mask = _mask(guides, item.identity, name, depsgraph)
            item.is_painted = bool((np.abs(mask - shown) > _LEAST_PAINT).any())


def _mask(guides, identity, name, depsgraph):
    """Return (G,) weights of a vertex group at the roots.

    Without the group or faces, set the error of the guides and return the weights of their last composition, or 1.
    """
    try:
        surface = scene.read_surface(guides.surface, depsgraph)
        weights = scene.read_vertex_group(guides.surface, depsgraph, name)
        roots = curves.read_roots(guides, surface, surface.from_local(curves.first_points(guides)))
    except HairError as error:
        guides.vellus.status = str(error)
        shown = layer_attributes.read_mask(guides, identity)
        return np.ones(len(guides.curves), np.float32) if shown is None else shown
    return np.clip(mesh_math.interpolate(weights, surface.mesh, roots), 0.0, 1.0)


def begin(guides: Curves, base: np.ndarray, is_grown: bool) -> None:
    """Store the base (N, 3) of guides, in local coordinates; is_grown: whether settings have grown it."""
    normals = attributes.read(guides, "surface_normal", "FLOAT_VECTOR", "CURVE")
    normals = np.zeros((len(guides.curves), 3), np.float32) if normals is None else normals
    layer_attributes.write(guides, guide_layers.without_layers(base, curves.point_counts(guides), normals), ())
    guides.vellus.is_base_grown = is_grown


def end(guides: Curves) -> None:
    """Forget all layers; points stay."""
    state = guides.vellus
    layer_attributes.forget(guides)
    state.layers.clear()
    state.active_layer, state.layered = 0, ""
