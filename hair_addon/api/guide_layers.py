# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: layers of guides."""

from typing import Any

from ..core.errors import HairError
from ..core.params import Param, plain_value
from .blender_access import blender

Curves = Any

_WEIGHT, _SWITCH = Param("", low=0.0, high=2.0), Param("")

__all__ = ["add_layer", "apply_layers", "layers", "set_layer"]


def layers(guides: Curves) -> dict[str, float]:
    """Return {name: weight} of the layers of guide Curves, from bottom to top; the weight of a hidden layer is 0.

    Guides that were combed since the last update of the view layer are recorded first.

    >>> guides = bpy.data.objects["Guides"]
    >>> api.layers(guides)
    {}
    """
    state = _target(guides).vellus
    names = blender.settings.layer_items.names_of(state)
    return {name: item.weight if item.is_on else 0.0 for name, item in zip(names, state.layers, strict=True)}


def add_layer(guides: Curves, name: str = "") -> str:
    """Add an empty layer above the active one and make it active; returns its name.

    The first layer takes the present combing. Changes of the guides' points, by `change_guides` or by scripts, are
    recorded in the active layer at the next update of the view layer.

    >>> guides = bpy.data.objects["Guides"]
    >>> api.add_layer(guides)
    'Combing'
    """
    name = plain_value("name", name, "", _SWITCH)
    target = _target(guides)
    return blender.groom.guides.layer_changes.add(target, blender.data.scene.present_depsgraph(), name)


def set_layer(guides: Curves, name: str, *, weight: float | None = None, is_active: bool = False) -> None:
    """Set the weight of a layer, from 0 to 2, or make it the active one; guides follow at the next update.

    A hidden layer that is given a weight is shown.

    >>> guides = bpy.data.objects["Guides"]
    >>> api.set_layer(guides, "Combing", weight=0.5)
    >>> api.layers(guides)
    {'Combing': 0.5}
    """
    name, is_active = plain_value("name", name, "", _SWITCH), plain_value("is_active", is_active, False, _SWITCH)
    weight = None if weight is None else plain_value("weight", weight, 1.0, _WEIGHT)
    target = _target(guides)
    names = blender.settings.layer_items.names_of(target.vellus)
    if name not in names:
        raise HairError(f"There is no layer {name!r}: add it first.")
    place = names.index(name)
    if weight is not None:
        target.vellus.layers[place].is_on = True
        target.vellus.layers[place].weight = weight
    if is_active:
        target.vellus.active_layer = place


def apply_layers(guides: Curves) -> int:
    """Remove all layers; guides keep their shape. Returns the number of layers.

    >>> guides = bpy.data.objects["Guides"]
    >>> api.apply_layers(guides)
    1
    """
    return blender.groom.guides.layer_changes.apply(_target(guides), blender.data.scene.present_depsgraph())


def _target(guides):
    """Record the edited points of guides in their layers and return the guides' Curves."""
    target = blender.data.arguments.guides_of(guides)
    blender.layers.recording.update(target, blender.data.scene.present_depsgraph())
    return target
