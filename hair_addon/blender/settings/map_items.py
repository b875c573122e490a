# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of a hair ↔ Blender's properties: a list with at most one map for each setting."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import bpy

from ...core.maps import ramp_text, varied_settings
from ...core.maps.map_settings import MapSettings
from ..host.notices import name_of, text_of
from . import ramp_nodes, setting_properties, style_keys
from .marks import mark_map
from .translations import CONTEXT


def _mark_image(item, context):
    """Remember the name of a map's image, which a status shows if the image is deleted; an `update`."""
    item.source = "" if item.image is None else name_of(item.image)
    mark_map(item, context)


_KEYED = ("kind", "low", "high", "is_inverted", "amount", "seed")


class VellusMap(bpy.types.PropertyGroup):
    """A map that varies a setting over the hair"""

    __annotations__ = {
        **setting_properties.annotations(MapSettings, mark_map, skip=("source", "ramp", "course")),
        "source": bpy.props.StringProperty(
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
            update=_mark_image,
        ),
        "ramp_tree": bpy.props.PointerProperty(
            name="Ramp",
            description="Node group with the ramp of the map's values",
            translation_context=CONTEXT,
            type=bpy.types.NodeTree,
            options={"HIDDEN"},
            update=mark_map,
        ),
        "ramp_key": bpy.props.StringProperty(description="The ramp at the last update", options={"HIDDEN"}),
        "course_tree": bpy.props.PointerProperty(
            name="Curve",
            description="Node group with the setting's curve from root to tip",
            translation_context=CONTEXT,
            type=bpy.types.NodeTree,
            options={"HIDDEN"},
            update=mark_map,
        ),
        "course_key": bpy.props.StringProperty(description="The curve at the last update", options={"HIDDEN"}),
    }


CLASSES = (VellusMap,)


def settings_of(item: VellusMap) -> MapSettings:
    """Return the `MapSettings` of an item. Raises `HairError`."""
    found = setting_properties.to_settings(item, MapSettings, skip=("ramp", "course"))
    found = replace(found, course=ramp_nodes.text_of(item.course_tree))
    if item.ramp_tree is not None:
        found = replace(found, ramp=ramp_nodes.text_of(item.ramp_tree))
    if found.kind != "IMAGE":
        return found
    return found if item.image is None else replace(found, source=name_of(item.image))


def values_of(item: VellusMap) -> dict[str, Any]:
    """Return {name: value} of the settings of a map that can be keyed, for comparison."""
    return setting_properties.values_of(item, _KEYED)


def maps_of(state) -> tuple[MapSettings, ...]:
    """Return the `MapSettings` of a hair's maps; state: its `VellusCurves`. Raises `HairError`."""
    return tuple(map(settings_of, state.maps))


def item_of(state, setting: str) -> VellusMap | None:
    """Return the item of a setting such as "look.color"; None if it has no map."""
    return next((item for item in state.maps if item.setting == setting), None)


def images_of(state) -> set[bpy.types.Image]:
    """Return the images that vary the settings of a hair."""
    return {item.image for item in state.maps if item.kind == "IMAGE"} - {None}


def is_set(item: VellusMap) -> bool:
    """Return whether a map has a source: new maps in the panel have none, and change nothing."""
    return item.kind in {"STRAND", "CLUMP"} or item.source != "" or (item.kind == "IMAGE" and item.image is not None)


def read_faces(state) -> bool:
    """Return whether maps vary the strands of a hair by values on faces of the surface."""
    return any(
        item.setting.startswith(("strands.", "styles.", "look.wetness"))
        and item.kind in {"IMAGE", "GROUP", "ATTRIBUTE"}
        and is_set(item)
        for item in state.maps
    )


def set_ramp(item: VellusMap, text: str) -> None:
    """Give a map the ramp of a text, or none for an empty text. Raises `HairError` before anything changes."""
    _set_tree(item, "ramp", "Ramp", text)


def set_course(item: VellusMap, text: str) -> None:
    """Set the curve from root to tip of a setting from a text; an empty text removes the curve.

    Raises `HairError` before anything changes.
    """
    ramp_text.require_curve(text)
    _set_tree(item, "course", "Curve", text)


def _set_tree(item, name, label, text):
    before = getattr(item, f"{name}_tree")
    wanted = ramp_nodes.replaced(before, item.id_data, label, text)
    if wanted != before:
        setattr(item, f"{name}_key", ramp_nodes.text_of(wanted))
        setattr(item, f"{name}_tree", wanted)
        ramp_nodes.remove_unused(before)


def add(state, setting: str) -> VellusMap:
    """Add a map without a source for a setting that has no map; returns the item."""
    item = state.maps.add()
    item.setting = setting
    return item


def keep(state, settings: MapSettings) -> VellusMap:
    """Add a map, or replace that of its setting; returns the item. Raises `HairError` before anything changes."""
    varied_settings.require_map(settings)
    item = item_of(state, settings.setting) or state.maps.add()
    item.setting = settings.setting
    item.image = bpy.data.images.get(settings.source) if settings.kind == "IMAGE" else None
    for name in setting_properties.names_of(MapSettings):
        if name not in ("ramp", "course"):
            setattr(item, name, getattr(settings, name))
    set_ramp(item, settings.ramp)
    set_course(item, settings.course)
    return item


def clear(state, setting: str) -> bool:
    """Remove the map of a setting, and keep its curve from root to tip; returns whether there was a map."""
    item = item_of(state, setting)
    course = "" if item is None else ramp_nodes.text_of(item.course_tree)
    if not course:
        return remove(state, setting)
    had_map = is_set(item)
    keep(state, MapSettings(setting=setting, course=course))
    return had_map


def remove(state, setting: str) -> bool:
    """Remove the map and the curve of a setting; returns whether it had any."""
    for index, item in enumerate(state.maps):
        if item.setting == setting:
            mark_map(item, None)
            trees = item.ramp_tree, item.course_tree
            _remove_with_keys(state, index)
            for tree in trees:
                ramp_nodes.remove_unused(tree)
            return True
    return False


def _remove_with_keys(state, index):
    """Remove a map with its keys; keys of the maps after it get their new indices."""
    names = [text_of(item, "setting") for item in state.maps]
    state.maps.remove(index)
    places = [None if place == index else place - (place > index) for place in range(len(names))]
    left = names[:index] + names[index + 1 :]
    style_keys.follow(state.id_data, style_keys.Rearrangement(names, places, left, "maps"))


def follow_styles(state, names: Sequence[str], places: Sequence[int | None], new_names: Sequence[str]) -> None:
    """Rename the maps of renamed styles, and remove the maps of removed styles.

    names: of the styles before; places: new index of each style, None for a removed one; new_names: present names.
    """
    now = {name: None if to is None else new_names[to] for name, to in zip(names, places, strict=True)}
    for setting in [item.setting for item in state.maps]:
        if now.get(varied_settings.style_of(setting)[0], "") is None:
            remove(state, setting)
    for item in state.maps:
        name, setting = varied_settings.style_of(item.setting)
        if now.get(name, name) != name:
            item.setting = varied_settings.setting_of_style(now[name], setting)


def copy_of_style(state, name: str, copied: str) -> None:
    """Add the maps of a style to a copy of the style."""
    for settings in maps_of(state):
        its_name, setting = varied_settings.style_of(settings.setting)
        if its_name == name:
            image = item_of(state, settings.setting).image
            item = keep(state, replace(settings, setting=varied_settings.setting_of_style(copied, setting)))
            item.image = image


def assign(state, maps: Sequence[MapSettings]) -> None:
    """Replace all maps. Raises `HairError` before anything changes."""
    for settings in maps:
        varied_settings.require_map(settings)
    wanted = {settings.setting for settings in maps}
    for setting in [item.setting for item in state.maps]:
        if setting not in wanted:
            remove(state, setting)
    for settings in maps:
        keep(state, settings)
