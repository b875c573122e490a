# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: maps, which give each strand its own value of a setting."""

from typing import Any

from ..core.errors import HairError
from ..core.maps import varied_settings
from ..core.maps.map_settings import MapSettings
from ..core.params import described
from .arguments import changed
from .blender_access import blender

Curves = Any
Image = Any

__all__ = ["MapSettings", "clear_map", "maps_of", "set_map"]


def set_map(hair: Curves, setting: str, source: Image | str = "", **changes: Any) -> MapSettings:
    """Vary a setting of hair Curves by a map, which replaces the setting's present map; returns the map.

    setting: such as "look.color" or "look.roughness"; source: an image, or "image:NAME", "group:NAME" of a vertex
    group, "attribute:NAME" of the surface, "curves:NAME" of an attribute of the hair's own curves, "strand" or "clump"
    for random numbers; changes: fields of `MapSettings`: uv, low, high, is_inverted, amount, seed.

    >>> coat = bpy.data.images.new("Coat", 8, 8)
    >>> hair = bpy.data.objects["Hair"].data
    >>> api.shade(hair, color=(0.3, 0.2, 0.1))
    >>> api.set_map(hair, "look.color", coat).source
    'Coat'
    """
    target = _editable(hair)
    if isinstance(source, str):
        kind, name = varied_settings.parsed_source(source)
    elif getattr(getattr(source, "bl_rna", None), "identifier", "") == "Image":
        kind, name = "IMAGE", source.name
    else:
        raise HairError(f"source must be an image or text, not {described(source)}.")
    varied_settings.require_varied(setting)
    settings = changed(MapSettings, MapSettings(setting=setting, kind=kind, source=name), changes)
    blender.settings.map_items.keep(target.vellus, settings)
    return settings


def maps_of(hair: Curves) -> tuple[MapSettings, ...]:
    """Return the maps of hair Curves.

    >>> [each.setting for each in api.maps_of(bpy.data.objects["Hair"])]
    ['look.color']
    """
    return blender.settings.map_items.maps_of(blender.data.arguments.curves_of(hair, "HAIR").vellus)


def clear_map(hair: Curves, setting: str) -> bool:
    """Remove the map of a setting; returns whether there was one.

    >>> api.clear_map(bpy.data.objects["Hair"], "look.color")
    True
    """
    varied_settings.require_varied(setting)
    return blender.settings.map_items.remove(_editable(hair).vellus, setting)


def _editable(hair):
    target = blender.data.arguments.curves_of(hair, "HAIR")
    blender.data.strands.curves.require_editable(target)
    return target
