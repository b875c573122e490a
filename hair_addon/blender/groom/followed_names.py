# SPDX-License-Identifier: GPL-3.0-or-later
"""Names in settings that follow what they name: images, objects and collections that are renamed.

Settings hold names. Beside them Curves keep a pointer for each, as a custom property, which Blender updates itself: it
also brings what is named along where hair is appended, under another name if there is one of that name. Vertex groups,
UV maps and attributes have no pointers: where they are missing, a sentence says so.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import bpy
from bpy.types import ID, Curves, PropertyGroup

from ...core.errors import HairError
from ...core.grooming.groom import GuideSettings, HairSettings
from ..data import masks, named_objects, scene
from ..host.notices import name_of, text_of
from ..settings import setting_properties, style_items
from . import staleness

_POINTERS = "vellus_named"  # custom property of Curves: {setting: {"name": as it was, "to": what it names}}

_SETTINGS = {
    "GUIDES": (
        ("guides", "density_image", "images"),
        ("guides", "flow_lines", "objects"),
        ("dynamics", "colliders", "collections"),
    ),
    "HAIR": (("hair", "density_image", "images"), ("hair", "part_lines", "objects")),
}
_OF_STYLES = (("mask_image", "images"), ("cutter", "objects"), ("target", "objects"))


def follow() -> None:
    """Give settings the new names of what was renamed. Nothing becomes stale by that."""
    for datablock in bpy.data.hair_curves:
        is_own = datablock.library is None and datablock.override_library is None
        if datablock.vellus.kind != "NONE" and is_own:
            _follow(datablock)


def _follow(datablock: Curves) -> None:
    kept = {} if _POINTERS not in datablock else datablock[_POINTERS].to_dict()
    now: dict[str, dict[str, Any]] = {}
    for key, group, field, source in _named(datablock):
        name = text_of(group, field)
        if not name:
            continue
        before = kept.get(key, {})
        to = _there(before.get("to")) if before.get("name") == name else None
        if to is None:
            to = _find(source, name)
        elif name_of(to) != name:
            _rename(datablock, group, field, to)
            name = name_of(to)
        now[key] = {"name": name} if to is None else {"name": name, "to": to}
    if now != kept:
        if _POINTERS in datablock:
            del datablock[_POINTERS]
        if now:
            datablock[_POINTERS] = now


def _named(datablock: Curves) -> Iterator[tuple[str, PropertyGroup, str, str]]:
    """(key, property group, field, collection of `bpy.data`) of the settings that name something."""
    state = datablock.vellus
    for group, field, source in _SETTINGS[state.kind]:
        yield f"{group}.{field}", getattr(state, group), field, source
    for item in state.styles:
        group = style_items.group_of(item)
        for field, source in _OF_STYLES:
            if field in group.bl_rna.properties:
                yield f"{text_of(item, 'name')}.{item.kind}.{field}", group, field, source


def _find(source: str, name: str) -> ID | None:
    return named_objects.find(name) if source == "objects" else getattr(bpy.data, source).get(name)


def _there(to: ID | None) -> ID | None:
    """What a pointer leads to; None of an object that was deleted, which only the pointer keeps in the file."""
    return None if isinstance(to, bpy.types.Object) and named_objects.find(name_of(to)) != to else to


def _rename(datablock, group, field, to):
    renew = _renewed_key(datablock, group, to) if field == "density_image" else None
    # Not by the property, whose `update` marks its Curves: nothing but the name has changed.
    group.bl_system_properties_get(do_create=True)[field] = name_of(to)
    if renew is not None:
        datablock.vellus.root_key = renew


def _renewed_key(datablock, group, image):
    """The key of roots that were placed by an image, under its new name; None where they are to be placed again."""
    settings_class = GuideSettings if datablock.vellus.kind == "GUIDES" else HairSettings
    try:
        settings = setting_properties.to_settings(group, settings_class)
        group_name = masks.of_curves(datablock).group
        density = scene.read_vertex_group(datablock.surface, scene.present_depsgraph(), group_name)
        values = scene.read_image(name_of(image))
    except HairError:
        return None
    if datablock.vellus.root_key != staleness.root_key(settings, density, values):
        return None
    return staleness.root_key(replace(settings, density_image=name_of(image)), density, values)
