# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of the list of guide layers: add, remove, duplicate, move, merge, apply."""

from dataclasses import replace

import numpy as np
from bpy.types import Curves, Depsgraph

from ....core import geometry
from ....core.errors import HairError
from ....core.grooming import guide_layers
from ....core.grooming.groom import GuideSettings
from ....core.long_work import no_progress
from ...data import masks, scene
from ...data.strands import curves, drawn_lines, layer_attributes
from ...host.notices import name_of, text_of
from ...layers import recording
from ...settings import layer_items, preferences, setting_properties
from .. import grown_guides, read_surfaces, size_fitting, varied_guides


def add(guides: Curves, depsgraph: Depsgraph, name: str = "") -> str:
    """Add an empty layer above the active one; returns its name. Raises `HairError` before anything changes.

    The first layer takes the combing of guides that settings have grown. Guides that were added or removed since then
    are the base as they are: settings no longer grow them.
    """
    _require_guides(guides)
    state = guides.vellus
    if not len(state.layers):
        points = curves.read_points(guides)
        is_grown = not curves.is_hand_made(guides) and len(guides.curves) == state.guides.guide_count
        base = _grown_base(guides, depsgraph) if is_grown and curves.is_combed(guides) else points
        recording.begin(guides, base, is_grown)
        _added(guides, name or layer_items.FIRST_NAME, 0)
        layers = layer_attributes.read(guides, layer_items.identities_of(state), np.ones((1, len(guides.curves))))
        layers, _changed = guide_layers.recorded(layers, 0, points)
        layer_attributes.write(guides, layers, layer_items.identities_of(state))
        recording.note_shape(guides)
    else:
        recording.update(guides, depsgraph)
        _added(guides, name or layer_items.FIRST_NAME, state.active_layer + 1)
    return text_of(layer_items.active_of(state), "name")


def _added(guides, name, place):
    """Add an empty layer to the list and to the attributes."""
    identity = layer_items.add(guides.vellus, name, place)
    bare = guide_layers.added(layer_attributes.read(guides, (), np.zeros((0, len(guides.curves)))))
    layer_attributes.write_layer(guides, bare, identity, 0)
    guides.update_tag()


def remove(guides: Curves, depsgraph: Depsgraph) -> None:
    """Remove the active layer with its combing; guides without layers are their base. Raises `HairError`."""
    state = _require_layers(guides)
    recording.update(guides, depsgraph)
    identity = state.layers[state.active_layer].identity
    layer_items.remove(state, state.active_layer)
    layer_attributes.forget(guides, identity)
    recording.show(guides, guide_layers.composed(recording.read(guides, depsgraph)))
    if not len(state.layers):
        recording.end(guides)


def duplicate(guides: Curves, depsgraph: Depsgraph) -> None:
    """Add a copy of the active layer above it, without keys. Raises `HairError`."""
    state = _require_layers(guides)
    recording.update(guides, depsgraph)
    place = state.active_layer
    layers, item = recording.read(guides, depsgraph), state.layers[place]
    weight, mask, is_on = item.weight, text_of(item, "mask"), item.is_on
    layer_attributes.write_layer(guides, layers, layer_items.add(state, text_of(item, "name"), place + 1), place)
    copy = state.layers[place + 1]
    copy.weight, copy.mask, copy.is_on = weight, mask, is_on
    _compose(guides, depsgraph)


def move(guides: Curves, depsgraph: Depsgraph, step: int) -> None:
    """Move the active layer up (1) or down (-1) in the list, if it has such a place. Raises `HairError`."""
    state = _require_layers(guides)
    recording.update(guides, depsgraph)
    to = state.active_layer + step
    if 0 <= to < len(state.layers):
        layer_items.move(state, state.active_layer, to)
        _compose(guides, depsgraph)


def merge_down(guides: Curves, depsgraph: Depsgraph) -> None:
    """Merge the active layer into the one below it, with their weights. Raises `HairError`."""
    state = _require_layers(guides)
    place = state.active_layer
    if place == 0:
        raise HairError("There is no layer below to merge into: pick a layer higher up.")
    recording.update(guides, depsgraph)
    layers = guide_layers.merged(recording.read(guides, depsgraph), place - 1)
    identity = state.layers[place].identity
    layer_items.remove(state, place)
    layer_attributes.forget(guides, identity)
    below = state.layers[place - 1]
    below.is_on, below.weight, below.mask = True, 1.0, ""
    state.active_layer = place - 1
    layer_attributes.write(guides, layers, layer_items.identities_of(state))
    _compose(guides, depsgraph)


def apply(guides: Curves, depsgraph: Depsgraph) -> int:
    """Keep the shape of guides and remove all layers; returns how many there were. Raises `HairError`.

    Settings no longer apply to guides that layers have changed, as after combing without layers.
    """
    state = _require_layers(guides)
    recording.update(guides, depsgraph)
    count = len(state.layers)
    if state.is_base_grown and not curves.is_hand_made(guides):
        base = recording.read(guides, depsgraph).base
        state.written = geometry.fingerprint.fingerprint(base)
    recording.end(guides)
    guides.update_tag()
    return count


def _compose(guides, depsgraph):
    recording.note_shown(guides, depsgraph)
    recording.show(guides, guide_layers.composed(recording.read(guides, depsgraph)))


def _require_guides(guides):
    curves.require_editable(guides)
    if not len(guides.curves):
        raise HairError('"{name}" has no guides: generate guides first.', name=name_of(guides))
    if not np.isfinite(curves.read_points(guides)).all():
        sentence = '"{name}" has non-finite coordinates: undo, or delete those guides.'
        raise HairError(sentence, name=name_of(guides))


def _require_layers(guides):
    """Return the `VellusCurves` of guides with an active layer. Raises `HairError`."""
    _require_guides(guides)
    if layer_items.active_of(guides.vellus) is None:
        raise HairError('"{name}" has no layers: add a layer first.', name=name_of(guides))
    return guides.vellus


def _grown_base(guides, depsgraph):
    """Return the points (N, 3) that settings would grow at the roots of combed guides, in local coordinates."""
    surface = read_surfaces.read(guides.surface, depsgraph)
    settings = setting_properties.to_settings(guides.vellus.guides, GuideSettings)
    settings = replace(settings, guide_density=0.0)  # the roots are known
    mask = masks.own(settings).read(guides.surface, surface, depsgraph)
    settings = size_fitting.of_guides(settings, surface, mask, guides).settings
    part_names = drawn_lines.part_names_around(guides)
    flow = drawn_lines.read_flow(guides.surface, surface, settings.flow_lines, part_names, depsgraph)
    shown = scene.shown_surface(guides.surface, surface)
    laid_flow = flow.at_rest(shown, surface, preferences.device())
    starts, local = curves.curve_offsets(guides), curves.read_points(guides)
    roots = curves.read_roots(guides, surface, surface.from_local(local[starts[:-1]]))
    settings = replace(settings, guide_count=len(roots))
    varied = varied_guides.read(guides, guides.surface, surface, settings)
    grown = grown_guides.grow(surface, settings, mask, laid_flow, no_progress, roots, varied).strands.numpy()
    base, counts = np.empty_like(local), np.diff(starts)
    for count in np.unique(counts):
        chosen = np.flatnonzero(counts == count)
        some = grown[chosen]
        if count != grown.shape[1]:
            own = np.arange(len(chosen) + 1) * grown.shape[1]
            some = geometry.curves.resampling.resample(some.reshape(-1, 3), own, max(int(count), 2))[:, :count]
        base[starts[chosen][:, None] + np.arange(count)] = surface.to_local(some)
    return base
