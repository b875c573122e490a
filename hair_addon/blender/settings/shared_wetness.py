# SPDX-License-Identifier: GPL-3.0-or-later
"""Wetness shared by hair and its guides: the largest of the values of look, Wet styles and dynamics.

Materials, viewports and the simulation use this value, so each of these sliders changes both appearance and motion; the
Wet style also changes the shape.
"""

import bpy

from ...core.styling.base import has_effect
from ...core.styling.program import mask_key
from ...core.styling.strand_wetness import mean_amount
from . import map_items, setting_properties, style_items, style_keys

SETTING = "look.wetness"


def of_hair(state):
    """Return (least, most) wetness of a hair, without and with its Wet styles and the map of its look.

    state: its `VellusCurves`.
    """
    guides = state.guide_curves
    of_dynamics = 0.0 if guides is None else _value(guides.vellus.dynamics)
    own = _value(state.appearance)
    item = map_of(state)
    least = of_dynamics if item is not None else max(own, of_dynamics)
    most = own if item is None else min(own * max(item.low, item.high, 1.0), 1.0)
    return least, max(least, most, setting_properties.shortest(style_items.wetness_of(state)))


def map_of(state):
    """Return the map of the look's wetness, which varies between strands; None without a source."""
    item = map_items.item_of(state, SETTING)
    return item if item is not None and map_items.is_set(item) else None


def of_guides(state):
    """Return the wetness of the wettest guides: the larger of their own and that of their wettest hair.

    Styles count with the mean over strands, as variation dries some strands. Raises `HairError`.
    """
    return _wettest(state, _wet_styles(state))


def evenly_of_guides(state):
    """Return the wetness that all guides have at least, without masked styles. Raises `HairError`."""
    return _wettest(state, [style for style in _wet_styles(state) if mask_key(style) is None])


def _wettest(state, styles):
    """Return the largest wetness of dynamics, of the looks of hair, and of some styles."""
    looks = [_value(hair.vellus.appearance) for hair in _followers(state)]
    amounts = [mean_amount(style) for style in styles if has_effect(style)]
    return setting_properties.shortest(max([_value(state.dynamics), *looks, *amounts]))


def masked_styles(state):
    """Return the settings of masked Wet styles of the guides' hair, including disabled ones. Raises `HairError`."""
    return [style for style in _wet_styles(state) if mask_key(style) is not None]


def _wet_styles(state):
    items = (item for hair in _followers(state) for item in hair.vellus.styles if item.kind == "WET")
    return [style_items.settings_of(item) for item in items]


def slider_of(state):
    """Return (property group, name) of the setting with the largest wetness of some guides and their hair.

    At equal values a Wet style comes first, as it also changes the shape, then dynamics.
    """
    found = [(_value(state.dynamics), 0, state.dynamics, "wetness")]
    for hair in _followers(state):
        found.append((_value(hair.vellus.appearance), -1, hair.vellus.appearance, "wetness"))
        items = (item for item in hair.vellus.styles if item.kind == "WET" and item.wet.is_on)
        found += [(setting_properties.shortest(item.wet.amount), 1, item.wet, "amount") for item in items]
    return max(found, key=lambda one: one[:2])[2:]


def _value(group):
    """Return the wetness of a group, 0 for NaN and values out of range."""
    value = setting_properties.shortest(group.wetness)
    return value if 0.0 <= value <= 1.0 else 0.0


def _followers(state):
    guides = state.id_data
    return [c for c in bpy.data.hair_curves if c.vellus.guide_curves == guides and c.vellus.kind == "HAIR" and c.users]


def is_keyed(state):
    """Whether the wetness of guides is animated or driven."""
    if "vellus.dynamics.wetness" in style_keys.keyed_paths(state.id_data):
        return True
    return any(_is_keyed_of_hair(hair) for hair in _followers(state))


def _is_keyed_of_hair(hair):
    paths = style_keys.keyed_paths(hair)
    ends = (".wet.amount", ".wet.is_on", ".wet.vary")
    return any(path == "vellus.appearance.wetness" or path.endswith(ends) for path in paths)
