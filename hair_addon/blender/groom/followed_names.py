# SPDX-License-Identifier: GPL-3.0-or-later
"""Names in settings that follow renamed images, objects and collections.

Settings store names. For images and collections, Curves also store a pointer in a custom property, which Blender
updates; when hair is appended, Blender appends the referenced datablock too, renamed if its name is in use. A pointer
would keep a deleted object alive, so objects are tracked by session UID while the file is open. Vertex groups, UV maps
and attributes have neither: if they are missing, a warning names them.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import bpy
from bpy.types import Curves, PropertyGroup

from ...core.errors import HairError
from ...core.grooming.groom import GuideSettings, HairSettings
from ...core.styling.kinds import KINDS
from ..data import masks, scene
from ..host.caches import Cache
from ..host.notices import name_of, text_of
from ..settings import setting_properties
from . import staleness

_POINTERS = "vellus_named"  # custom property of Curves: {setting: {"name": former name, "to": datablock}}

object_cache = Cache()  # (session UID of Curves, setting) → (former name, session UID of the object)

_SETTINGS = {
    "GUIDES": (
        ("guides", "density_image", "images"),
        ("guides", "flow_lines", "objects"),
        ("", "tie_lines", "objects"),
        ("dynamics", "colliders", "collections"),
    ),
    "HAIR": (("hair", "density_image", "images"), ("hair", "part_lines", "objects")),
}
_SOURCES = {"mask_image": "images", "cutter": "objects", "target": "objects"}
_OF_STYLES = {
    kind: [(name, _SOURCES[name]) for name in setting_properties.names_of(settings_class) if name in _SOURCES]
    for kind, settings_class in KINDS.items()
}


def follow() -> None:
    """Update names in settings after renaming, without marking anything stale."""
    for datablock in bpy.data.hair_curves:
        is_own = datablock.library is None and datablock.override_library is None
        if datablock.vellus.kind != "NONE" and is_own:
            _follow(datablock)


def _follow(datablock: Curves) -> None:
    pointers = _pointers(datablock)
    now: dict[str, dict[str, Any]] = {}
    for key, group, field, source in _named(datablock):
        name = text_of(group, field)
        found = getattr(bpy.data, source).get(name)
        if source == "objects":
            to = _object(datablock, key, name, found)
        else:
            before = pointers.get(key, {})
            to = before.get("to") if before.get("name") == name else None
        if to is None:
            to = found
        elif name_of(to) != name:
            _rename(datablock, group, field, to)
            name = name_of(to)
        if isinstance(to, bpy.types.Object):
            object_cache.keep((datablock.session_uid, key), (name, to.session_uid))
        elif to is not None:
            now[key] = {"name": name, "to": to}
    if now != pointers:
        if _POINTERS in datablock:
            del datablock[_POINTERS]
        if now:
            datablock[_POINTERS] = now


def _pointers(datablock):
    """Return {setting: {"name": str, "to": ID}}; empty if a damaged file has text that is not UTF-8.

    It reads entry by entry, as `to_dict` would leave the error set for the code that runs next.
    """
    try:
        entries = datablock.get(_POINTERS, {})
        return {key: {name: entries[key][name] for name in ("name", "to")} for key in entries.keys()}
    except (UnicodeDecodeError, KeyError):
        return {}


def _object(datablock, key, name, found):
    """Return the object that had this name when the setting was set, whatever its present name; None if unknown."""
    place = datablock.session_uid, key
    known_name, uid = object_cache.get(place) or ("", 0)
    if known_name != name or (found is not None and found.session_uid == uid):
        return found
    object_cache.invalidate(place)  # so that a deleted object is searched for only once
    return next((one for one in bpy.data.objects if one.session_uid == uid), None)


def _named(datablock: Curves) -> Iterator[tuple[str, PropertyGroup, str, str]]:
    """Yield (key, property group, field, collection of `bpy.data`) of the settings that store a name."""
    state = datablock.vellus
    for owner, field, source in _SETTINGS[state.kind]:
        group = getattr(state, owner) if owner else state
        if text_of(group, field):
            yield f"{owner}.{field}", group, field, source
    for item in state.styles:
        kind = item.kind
        group = getattr(item, kind.lower())
        for field, source in _OF_STYLES[kind]:
            if text_of(group, field):
                yield f"{text_of(item, 'name')}.{kind}.{field}", group, field, source


def _rename(datablock, group, field, to):
    renew = _renewed_key(datablock, group, to) if field == "density_image" else None
    # Bypasses the property, whose `update` would mark its Curves stale: only the name has changed.
    group.bl_system_properties_get(do_create=True)[field] = name_of(to)
    if renew is not None:
        datablock.vellus.root_key = renew


def _renewed_key(datablock, group, image):
    """Return the root key with the new name of a renamed density image; None if roots are to be placed again."""
    settings_class = GuideSettings if datablock.vellus.kind == "GUIDES" else HairSettings
    try:
        settings = setting_properties.to_settings(group, settings_class)
        group_name = masks.of_curves(datablock).group
        density = scene.read_cage_weights(datablock.surface, scene.present_depsgraph(), group_name)
        values = scene.read_image(name_of(image))
    except HairError:
        return None
    if datablock.vellus.root_key != staleness.root_key(settings, density, values):
        return None
    return staleness.root_key(replace(settings, density_image=name_of(image)), density, values)
