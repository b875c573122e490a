# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of a hair ↔ Blender's properties: a list with at most one map for each setting."""

from collections.abc import Sequence

import bpy

from ...core.errors import HairError
from ...core.maps import varied_settings
from ...core.maps.map_settings import MapSettings
from ..host.notices import name_of
from . import setting_properties
from .marks import mark_map
from .translations import CONTEXT

_SKIPPED = ("name",)


class VellusMap(bpy.types.PropertyGroup):
    """A map that varies a setting over the hair"""

    __annotations__ = {
        **setting_properties.annotations(MapSettings, mark_map, skip=_SKIPPED),
        # Blender shows items of lists by this name.
        "name": bpy.props.StringProperty(
            name="Name",
            description="Name of the vertex group or attribute",
            translation_context=CONTEXT,
            update=mark_map,
        ),
        "image": bpy.props.PointerProperty(
            name="Image",
            description="Image whose pixels vary the setting",
            translation_context=CONTEXT,
            type=bpy.types.Image,
            update=mark_map,
        ),
    }


CLASSES = (VellusMap,)


def settings_of(item: VellusMap) -> MapSettings:
    """Return the `MapSettings` of an item. Raises `HairError`."""
    found = setting_properties.to_settings(item, MapSettings)
    if found.kind != "IMAGE":
        return found
    values = {name: getattr(found, name) for name in setting_properties.names_of(MapSettings)}
    return MapSettings(**values | {"name": "" if item.image is None else name_of(item.image)})


def maps_of(state) -> tuple[MapSettings, ...]:
    """Return the `MapSettings` of a hair's maps; state: its `VellusCurves`. Raises `HairError`."""
    return tuple(map(settings_of, state.maps))


def item_of(state, setting: str) -> VellusMap | None:
    """Return the item of a setting such as "look.color"; None if it has no map."""
    return next((item for item in state.maps if item.setting == setting), None)


def images_of(state) -> set[bpy.types.Image]:
    """Return the images that vary the settings of a hair."""
    return {item.image for item in state.maps if item.kind == "IMAGE"} - {None}


def keep(state, settings: MapSettings) -> VellusMap:
    """Add a map, or replace that of its setting; returns the item. Raises `HairError` before anything changes."""
    varied_settings.require_varied(settings.setting)
    image = _image_of(settings)
    item = item_of(state, settings.setting) or state.maps.add()
    item.setting = settings.setting
    values = {name: getattr(settings, name) for name in setting_properties.names_of(MapSettings)}
    for name, value in values.items():
        if name != "name" or settings.kind != "IMAGE":
            setattr(item, name, value)
    item.image = image
    return item


def remove(state, setting: str) -> bool:
    """Remove the map of a setting; returns whether there was one."""
    for index, item in enumerate(state.maps):
        if item.setting == setting:
            mark_map(item, None)
            state.maps.remove(index)
            return True
    return False


def assign(state, maps: Sequence[MapSettings]) -> None:
    """Replace all maps. Raises `HairError` before anything changes."""
    for settings in maps:
        varied_settings.require_varied(settings.setting)
        _image_of(settings)
    wanted = {settings.setting for settings in maps}
    for setting in [item.setting for item in state.maps]:
        if setting not in wanted:
            remove(state, setting)
    for settings in maps:
        keep(state, settings)


def _image_of(settings):
    if settings.kind != "IMAGE" or not settings.name:
        return None
    image = bpy.data.images.get(settings.name)
    if image is None:
        raise HairError('There is no image "{name}": pick another image, or clear the field.', name=settings.name)
    return image
