# SPDX-License-Identifier: GPL-3.0-or-later
"""Looks of strands by maps, as arrays.

One function computes the arrays, which the hair's Curves store for viewports and renders.
"""

import math
from dataclasses import dataclass

import numpy as np

from ....core import maps
from ....core.errors import HairError
from ....core.maps import combination, varied_settings
from ....core.shading.appearance import Appearance
from ....core.shading.strand_looks import StrandLooks, strand_looks
from ...host.caches import Cache
from ...settings import map_items, properties, shared_wetness
from ..strands import attributes
from . import ramps, sources

# Attributes of the hair's Curves; the last is absent if the radial roughness does not vary.
ROOT, TIP, ROUGHNESS, RADIAL = "root_absorption", "tip_absorption", "strand_roughness", "strand_radial_roughness"
_LAYOUT = ((ROOT, "FLOAT_VECTOR"), (TIP, "FLOAT_VECTOR"), (ROUGHNESS, "FLOAT"))


@dataclass(frozen=True, eq=False)
class _Known:
    """`StrandLooks` and what determines them; given: {field of `Appearance`: (values of strands, `Combination`)}."""

    look: Appearance
    given: dict
    randoms: np.ndarray
    looks: StrandLooks


# session_uid of hair → `_Known`, which is compared.
look_cache = Cache(capacity=4)


def has_looks(state) -> bool:
    """Whether maps vary the look of a hair."""
    return any(True for _ in _maps_of_look(state))


def _maps_of_look(state):
    """Yield the maps of settings that the look uses, except wetness, which has its own attribute."""
    for item in state.maps:
        is_of_look = item.setting.startswith("look.") and item.setting in varied_settings.all_varied()
        if not is_of_look or item.setting == shared_wetness.SETTING or not map_items.is_set(item):
            continue
        if varied_settings.is_used(item.setting, state.appearance.parametrization):
            yield item


def looks_of(hair, strands: "sources.Strands | None" = None) -> tuple[StrandLooks | None, list[HairError]]:
    """Return (`StrandLooks` of hair Curves, errors about missing sources); None without maps of the look.

    strands: strands to return looks for; None: the stored strands. A setting with a missing source keeps its value.
    """
    items = list(_maps_of_look(hair.vellus))
    if not items:
        return None, []
    if strands is None:
        strands = sources.stored_strands(hair)
    look, errors = properties.own_look_of(hair.vellus), []
    given = {}
    for item in items:
        try:
            given[item.setting.removeprefix("look.")] = _values(strands, item)
        except HairError as error:
            errors.append(error)
    return _followed(hair.session_uid, look, given, strands.randoms), errors


def _values(strands, item):
    """Return (values of strands, their `Combination`) of a map."""
    is_color = varied_settings.is_color(item.setting)
    ramp = ramps.map_samples(item, is_color)
    return sources.values_of(strands, map_items.settings_of(item), item.image, is_color and ramp is None, ramp)


def _followed(hair_uid, look, given, randoms):
    """Return `StrandLooks`; strands whose values have not changed keep their known looks."""
    known = look_cache.get(hair_uid)
    changed = None if known is None else _changed(known, look, given, randoms)
    if changed is None:
        found = _looks(look, given, randoms)
    else:
        some = {name: (values[changed], how) for name, (values, how) in given.items()}
        found = known.looks.replaced(changed, _looks(look, some, randoms[changed]))
    look_cache.keep(hair_uid, _Known(look, given, randoms, found))
    return found


def _changed(known, look, given, randoms):
    """Return the indices of strands whose values differ from the known ones; None if most may differ."""
    hows = [{name: how for name, (_values, how) in each.items()} for each in (known.given, given)]
    pairs = [(known.randoms, randoms), *((known.given[n][0], given[n][0]) for n in given if n in known.given)]
    if known.look != look or hows[0] != hows[1] or any(one.dtype != two.dtype for one, two in pairs):
        return None
    if any(one.shape != two.shape for one, two in pairs):
        return None
    is_changed = np.zeros(len(randoms), bool)
    for one, two in pairs:
        if one is not two:
            for channel in (_bits(one) != _bits(two)).T:  # faster than a reduction along short rows
                is_changed |= channel
    found = np.flatnonzero(is_changed)
    return found if 2 * len(found) <= len(randoms) else None


def _bits(values):
    return np.ascontiguousarray(values).view(f"i{values.itemsize}").reshape(len(values), math.prod(values.shape[1:]))


def _looks(look, given, randoms):
    varied = {}
    for name, (values, how) in given.items():
        setting, value = f"look.{name}", getattr(look, name)
        details = varied_settings.all_varied()[setting][1]
        if varied_settings.is_color(setting):
            colors, alpha = maps.pixels.unpremultiplied(values)
            varied[name] = combination.varied_color(value, colors, alpha, how, details)
        else:
            varied[name] = combination.varied_number(value, values[:, 0], how, details)
    return strand_looks(look, varied, randoms)


# session_uid of hair → `StrandLooks` that are newer than its Curves; cleared by undo.
pending_cache = Cache()


def write_looks(hair, is_soon: bool = False) -> tuple[StrandLooks | None, list[HairError]]:
    """Store the looks of strands in their Curves, or remove them; returns the result of `looks_of`.

    is_soon: `write_pending` stores them later, because Blender evaluates changed Curves more slowly than maps are read.
    """
    looks, errors = looks_of(hair) if len(hair.curves) else (None, [])
    pending_cache.invalidate(hair.session_uid)
    if looks is None:
        if has(hair):
            for name, _data_type in _LAYOUT:
                hair.attributes.remove(hair.attributes[name])
        _write_radial(hair, None)
    elif is_soon and has(hair) and has_radial(hair) == (looks.radial is not None):
        pending_cache.keep(hair.session_uid, looks)
    else:
        _write(hair, looks)
    return looks, errors


def is_pending(hair) -> bool:
    """Whether hair has looks that are not stored yet."""
    return pending_cache.get(hair.session_uid) is not None


def write_pending(hair) -> None:
    """Store the looks that are not stored yet, unless the number of strands has changed."""
    looks = pending_cache.get(hair.session_uid)
    pending_cache.invalidate(hair.session_uid)
    if looks is not None and len(looks) == len(hair.curves):
        _write(hair, looks)


def _write(hair, looks):
    for (name, data_type), values in zip(_LAYOUT, (looks.root, looks.tip, looks.roughness), strict=True):
        attributes.write(hair, name, data_type, "CURVE", values)
    _write_radial(hair, looks.radial)


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
    """Return the `StrandLooks` of Curves, possibly evaluated or linked, also if they are not stored yet; None without
    looks. Invalid values are 0.
    """
    if not has(hair):
        return None
    pending = pending_cache.get(hair.session_uid)
    if pending is not None and len(pending) == len(hair.curves):
        return pending
    found = [attributes.read(hair, name, data_type, "CURVE") for name, data_type in _LAYOUT]
    radial = attributes.read(hair, RADIAL, "FLOAT", "CURVE") if has_radial(hair) else None
    return StrandLooks(
        *(np.clip(np.where(np.isfinite(values), values, 0.0), 0.0, 1e3) for values in found),
        None if radial is None else np.clip(np.where(np.isfinite(radial), radial, 0.0), 0.0, 1.0),
    )
