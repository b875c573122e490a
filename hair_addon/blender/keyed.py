# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that are keyed or driven: what they say in a frame is what hair is made of there.

Blender moves animated properties without calling their `update`, so their values are compared with those before.
"""

import bpy

from ..core.groom import GuideSettings, HairSettings
from ..core.shading import appearance, lookup_tables
from . import properties

_GROUPS = {
    "guides": properties.names_of(GuideSettings),
    "hair": properties.names_of(HairSettings),
    "appearance": properties.names_of(appearance.Appearance),
    "marschner": [n for n in properties.names_of(lookup_tables.Settings) if n not in appearance.TABLE_FIELDS],
}

# session_uid → values of all settings when they were looked at last.
_known = {}


def are_keyed(datablock):
    """Whether any property of Curves may be moved by a key or a driver."""
    animation = datablock.animation_data
    return animation is not None and bool(animation.action or animation.drivers or animation.nla_tracks)


def may_follow(scene, depsgraph):
    """Whether data may be written now: a render in a window runs beside its interface unless that is locked."""
    return depsgraph.mode == "VIEWPORT" or bpy.app.background or scene.render.use_lock_interface


def remember():
    """Before another frame: what hair is made of now."""
    for datablock in _keyed():
        _known[datablock.session_uid] = _values(datablock.vellus)


def follow(depsgraph):
    """Mark as stale what animation has outdated, if anything; whether it has. A render keeps its values apart."""
    is_render = depsgraph.mode == "RENDER"
    is_outdated = False
    for datablock in _keyed():
        state = datablock.vellus
        # Blender moves the file's own values for viewports alone.
        values = _values(datablock.evaluated_get(depsgraph).vellus if is_render else state)
        before = _known.get(datablock.session_uid, values)
        if values == before:
            continue
        _known[datablock.session_uid], is_outdated = values, True
        for group in _GROUPS:
            for name, value in values[group].items():
                if value != before[group][name]:
                    setattr(getattr(state, group), name, value)  # whose `update` marks it
    return is_outdated


def forget():
    """Undo and another file bring other data."""
    _known.clear()


def _keyed():
    return [c for c in bpy.data.hair_curves if c.vellus.kind != "NONE" and c.library is None and are_keyed(c)]


def _values(state):
    return {group: properties.values_of(getattr(state, group), names) for group, names in _GROUPS.items()}
