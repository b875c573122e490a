# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks of strands by maps, as arrays.

One function computes the arrays, which the hair's Curves store for viewports and renders.
"""

import numpy as np

from ....core.errors import HairError
from ....core.maps import varied_settings
from ....core.shading.strand_looks import StrandLooks, strand_looks
from ...settings import map_items, properties, shared_wetness
from ..strands import attributes
from . import ramps, sources

# Attributes of the hair's Curves; the last is absent if the radial roughness does not vary.
ROOT, TIP, ROUGHNESS, RADIAL = "root_absorption", "tip_absorption", "strand_roughness", "strand_radial_roughness"
_LAYOUT = ((ROOT, "FLOAT_VECTOR"), (TIP, "FLOAT_VECTOR"), (ROUGHNESS, "FLOAT"))


def has_looks(state) -> bool:
    """Whether maps vary the look of a hair."""
    return any(
        item.setting.startswith("look.")
        and item.setting != shared_wetness.SETTING
        and map_items.is_set(item)
        and varied_settings.is_used(item.setting, state.appearance.parametrization)
        for item in state.maps
    )


def looks_of(hair, strands: "sources.Strands | None" = None) -> tuple[StrandLooks | None, list[HairError]]:
    """Return (`StrandLooks` of hair Curves, errors about missing sources); None without maps of the look.

    strands: strands to return looks for; None: the stored strands. A setting with a missing source keeps its value.
    """
    if not has_looks(hair.vellus):
        return None, []
    if strands is None:
        strands = sources.stored_strands(hair)
    look, errors = properties.own_look_of(hair.vellus), []
    varied = {}
    for item in hair.vellus.maps:
        section, _, name = item.setting.partition(".")
        if section != "look" or item.setting not in varied_settings.all_varied() or not map_items.is_set(item):
            continue
        if item.setting == shared_wetness.SETTING or not varied_settings.is_used(item.setting, look.parametrization):
            continue
        try:
            varied[name] = _varied(strands, item, getattr(look, name))
        except HairError as error:
            errors.append(error)
    return strand_looks(look, varied, strands.randoms), errors


def _varied(strands, item, value):
    """Return (S,) or (S, 3) of a setting by its map."""
    settings, details = map_items.settings_of(item), varied_settings.all_varied()[item.setting][1]
    is_color = varied_settings.is_color(item.setting)
    vary = sources.varied_colors if is_color else sources.varied_numbers
    return vary(strands, settings, item.image, value, details, ramps.map_samples(item, is_color))


def write_looks(hair) -> list[HairError]:
    """Store the looks of strands in their Curves, or remove them; returns errors about missing sources."""
    looks, errors = looks_of(hair) if len(hair.curves) else (None, [])
    if looks is None:
        if has(hair):
            for name, _data_type in _LAYOUT:
                hair.attributes.remove(hair.attributes[name])
        _write_radial(hair, None)
        return errors
    for (name, data_type), values in zip(_LAYOUT, (looks.root, looks.tip, looks.roughness), strict=True):
        attributes.write(hair, name, data_type, "CURVE", values)
    _write_radial(hair, looks.radial)
    return errors


def _write_radial(hair, values):
    if values is not None:
        attributes.write(hair, RADIAL, "FLOAT", "CURVE", values)
    elif has_radial(hair):
        hair.attributes.remove(hair.attributes[RADIAL])


def has(hair) -> bool:
    """Whether Curves, possibly evaluated or linked, store looks of strands."""
    return all(attributes.has(hair, name, data_type, "CURVE") for name, data_type in _LAYOUT)


def has_radial(hair) -> bool:
    """Whether Curves, possibly evaluated or linked, store a radial roughness for each strand."""
    return attributes.has(hair, RADIAL, "FLOAT", "CURVE")


def read_looks(hair) -> StrandLooks | None:
    """Return the stored `StrandLooks` of Curves, possibly evaluated or linked; None without them. Invalid values are
    0.
    """
    if not has(hair):
        return None
    found = [attributes.read(hair, name, data_type, "CURVE") for name, data_type in _LAYOUT]
    radial = attributes.read(hair, RADIAL, "FLOAT", "CURVE") if has_radial(hair) else None
    return StrandLooks(
        *(np.clip(np.where(np.isfinite(values), values, 0.0), 0.0, 1e3) for values in found),
        None if radial is None else np.clip(np.where(np.isfinite(radial), radial, 0.0), 0.0, 1.0),
    )
