# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of layers of guides: name, eye, weight and mask of each. Keys follow their layer (style_keys.py)."""

import bpy

from ...core.errors import HairError
from ...core.grooming.guide_layers import LEAST_WEIGHT
from ..host.notices import text_of
from . import style_items, style_keys
from .marks import mark_shown
from .translations import CONTEXT

FIRST_NAME = "Combing"
MOST_LAYERS = 32


def _renamed(item, name, present, _is_set):
    """Return a unique name for a layer; data paths of keys with the old name are updated."""
    state = item.id_data.vellus
    name = style_items.unique_name(name.strip() or FIRST_NAME, [other for other in names_of(state) if other != present])
    if present and name != present:
        names = names_of(state)
        renamed = [name if other == present else other for other in names]
        style_keys.follow(item.id_data, style_keys.Rearrangement(names, range(len(names)), renamed, "layers"))
    return name


class VellusLayer(bpy.types.PropertyGroup):
    """A layer of guides"""

    __annotations__ = {
        "name": bpy.props.StringProperty(
            name="Name", description="Name of the layer", translation_context=CONTEXT, set_transform=_renamed
        ),
        "is_on": bpy.props.BoolProperty(
            name="Show Layer",
            description="Use this layer; a hidden layer cannot be combed",
            translation_context=CONTEXT,
            default=True,
            update=mark_shown,
        ),
        "weight": bpy.props.FloatProperty(
            name="Layer Weight",
            description="Factor of the turning and stretching of guides by the layer: 0.5 halves it, 2 doubles it",
            translation_context=CONTEXT,
            min=0.0,
            max=2.0,
            soft_max=1.0,
            default=1.0,
            subtype="FACTOR",
            update=mark_shown,
        ),
        "mask": bpy.props.StringProperty(
            name="Layer Mask",
            description="Vertex group of the surface that limits the layer; its weight at a root multiplies the weight "
            "of the layer",
            translation_context=CONTEXT,
            update=mark_shown,
        ),
        "identity": bpy.props.IntProperty(description="Number of the layer in names of attributes", options={"HIDDEN"}),
        "shown_weight": bpy.props.FloatProperty(description="Weight in the current guides", options={"HIDDEN"}),
        "shown_mask": bpy.props.StringProperty(description="Mask in the current guides", options={"HIDDEN"}),
        "is_painted": bpy.props.BoolProperty(
            description="Whether the mask was painted since guides were composed", options={"HIDDEN"}
        ),
    }


CLASSES = (VellusLayer,)


def names_of(state):
    """Return the names of layers, from bottom to top; state: `VellusCurves` of guides."""
    return tuple(text_of(item, "name") for item in state.layers)


def identities_of(state):
    """Return the identities of layers, from bottom to top, which their attributes are named by."""
    return tuple(item.identity for item in state.layers)


def active_of(state):
    """Return the active layer, None without layers."""
    return state.layers[state.active_layer] if state.active_layer < len(state.layers) else None


def wanted(item):
    """Return (weight, mask) that an item sets."""
    return (item.weight if item.is_on else 0.0), text_of(item, "mask")


def is_reweighed(state):
    """Whether weights or masks have changed since guides were composed."""
    return any(
        item.is_painted or wanted(item) != (item.shown_weight, text_of(item, "shown_mask")) for item in state.layers
    )


def note_shown(state):
    """Note that guides are composed with the present weights and masks."""
    for item in state.layers:
        item.shown_weight, item.shown_mask = wanted(item)
        item.is_painted = False


def require_combable(state):
    """Raise `HairError` if combing would be recorded in a layer that is hidden or has no weight."""
    item = active_of(state)
    if item is None:
        return
    if not item.is_on:
        raise HairError('The layer "{name}" is hidden: show it to comb it.', name=text_of(item, "name"))
    if item.weight < LEAST_WEIGHT:
        raise HairError('The layer "{name}" has no weight: increase it to comb it.', name=text_of(item, "name"))


def add(state, name, place):
    """Add a layer at an index of the list, make it active and return its identity. Raises `HairError`."""
    if len(state.layers) >= MOST_LAYERS:
        raise HairError("Guides have at most {count} layers: remove or merge some.", count=MOST_LAYERS)
    names, identity = names_of(state), max(identities_of(state), default=0) + 1
    item = state.layers.add()
    item.identity, item.name = identity, name
    state.layers.move(len(names), place)
    _follow(state, names, [*range(place), None, *range(place, len(names))])
    state.active_layer = place
    state.layers[place].shown_weight = 1.0
    return identity


def move(state, place, to):
    """Move a layer from one index of the list to another."""
    names, order = names_of(state), list(range(len(state.layers)))
    order.insert(to, order.pop(place))
    state.layers.move(place, to)
    _follow(state, names, order)
    state.active_layer = to


def remove(state, place):
    """Remove a layer with its keys."""
    names = names_of(state)
    state.layers.remove(place)
    _follow(state, names, [index for index in range(len(names)) if index != place])
    state.active_layer = min(state.active_layer, max(len(state.layers) - 1, 0))


def _follow(state, names, order):
    """Update the keys of layers; order: previous index of each layer in the list, None for a new layer."""
    places = [order.index(index) if index in order else None for index in range(len(names))]
    style_keys.follow(state.id_data, style_keys.Rearrangement(names, places, names_of(state), "layers"))
