# SPDX-License-Identifier: GPL-3.0-or-later
"""Animated and driven settings: hair is regenerated in frames where they change.

Blender animates properties without calling their `update`, so their values are compared with the previous ones.
"""

import contextlib

import bpy

from ...core.dynamics.rod.settings import DynamicsSettings
from ...core.grooming.groom import GuideSettings, HairSettings
from ...core.shading import appearance
from ...core.shading.tables import lookup_tables
from ..host import scene_time
from ..host.caches import Cache
from ..host.notices import text_of
from . import map_items, setting_properties, style_items, style_keys

_GROUPS = {
    "guides": setting_properties.names_of(GuideSettings),
    "hair": setting_properties.names_of(HairSettings),
    "dynamics": setting_properties.names_of(DynamicsSettings),
    "appearance": setting_properties.names_of(appearance.Appearance),
    "marschner": [n for n in setting_properties.names_of(lookup_tables.Settings) if n not in appearance.TABLE_FIELDS],
}

_RADII = {diameter: radius for radius, diameter in setting_properties.diameters(HairSettings)}

# session_uid of Curves → (last known values of all settings, paths that were keyed or driven at that time)
value_cache = Cache()


def are_keyed(datablock):
    """Whether any property of Curves may be animated or driven."""
    animation = datablock.animation_data
    return animation is not None and bool(animation.action or animation.drivers or animation.nla_tracks)


def keyed_ramps(curves):
    """Return the maps of Curves whose color ramps may be animated or driven."""
    maps = curves.vellus.maps
    return [item for item in maps if item.ramp_tree is not None and are_keyed(item.ramp_tree)]


def remember(is_made_with=False):
    """Store setting values before a frame change; is_made_with: whether strands match the present animated values."""
    for datablock in _keyed():
        known = value_cache.get(datablock.session_uid)
        paths = style_keys.keyed_paths(datablock) if is_made_with else set() if known is None else known[1]
        value_cache.keep(datablock.session_uid, (_values(datablock.vellus), paths))


def follow(depsgraph):
    """Mark Curves as stale whose animated settings changed; returns whether any did. Renders use their own values.

    The first value of a new key or driver counts as a change, as the value that strands were made with is unknown.
    """
    is_render = scene_time.is_rendered(depsgraph)
    is_outdated = False
    for datablock in _keyed():
        state = datablock.vellus
        # Blender animates the original values only for viewports.
        values = _values(datablock.evaluated_get(depsgraph).vellus if is_render else state)
        paths = style_keys.keyed_paths(datablock)
        before, known = value_cache.get(datablock.session_uid) or (values, set())
        if values == before and paths <= known:
            continue
        value_cache.keep(datablock.session_uid, (values, paths))
        is_outdated, new = True, _at(datablock, paths - known)
        for key, group in _groups(state).items():
            of_group = before.get(key, values[key])
            for name, value in values[key].items():
                if value != of_group[name] or (group, name) in new:
                    setattr(group, name, value)  # its `update` marks the change
    return is_outdated


def _keyed():
    return [c for c in bpy.data.hair_curves if c.vellus.kind != "NONE" and c.library is None and are_keyed(c)]


def _values(state):
    values = {name: setting_properties.values_of(getattr(state, name), names) for name, names in _GROUPS.items()}
    values |= {_key(item): style_items.values_of(item) for item in state.styles}
    return values | {_key_of_map(item): map_items.values_of(item) for item in state.maps}


def _groups(state):
    """Return {key in `_values`: property group}."""
    groups = {name: getattr(state, name) for name in _GROUPS}
    groups |= {_key(item): style_items.group_of(item) for item in state.styles}
    return groups | {_key_of_map(item): item for item in state.maps}


def _at(datablock, paths):
    """Return [(property group, name)] of the settings at some data paths; radii in place of diameters."""
    found = []
    for path in paths:
        owner, _, name = path.rpartition(".")
        with contextlib.suppress(ValueError):  # Blender keeps invalid data paths
            found.append((datablock.path_resolve(owner), _RADII.get(name, name)))
    return found


def _key(item):
    """Return the key of a style, independent of its index in the list."""
    return item.kind, text_of(item, "name")


def _key_of_map(item):
    return "map", text_of(item, "setting")
