# SPDX-License-Identifier: GPL-3.0-or-later
"""Python interface: maps, which give each strand its own value of a setting."""

from typing import Any

from ..core.errors import HairError
from ..core.maps import ramp_text, varied_settings
from ..core.maps.map_settings import MapSettings
from ..core.params import described
from .arguments import changed
from .blender_access import blender

Curves = Any
Image = Any

__all__ = ["MapSettings", "clear_map", "maps_of", "set_course", "set_map", "set_thickness_curve", "thickness_curve_of"]


def set_map(hair: Curves, setting: str, source: Image | str = "", **changes: Any) -> MapSettings:
    """Vary a setting of hair Curves by a map, which replaces the setting's present map; returns the map.

    setting: such as "look.color", "styles.Curl.radius" of the style with the name Curl, or "guides.length" of its
    guides; source: an image, or "image:NAME", "group:NAME" of a vertex group, "attribute:NAME" of the surface,
    "curves:NAME" of an attribute of the hair's own curves, "strand" or "clump" for random numbers; changes: fields of
    `MapSettings`: uv, low, high, is_inverted, amount, seed, ramp, course. ramp: a curve of the map's values such as
    "0:0 0.3:1 1:1", or a color ramp "0:0.1/0/0 1:1/0.8/0.5" that gives the colors; course: the curve that `set_course`
    sets, by default the present one.

    >>> coat = bpy.data.images.new("Coat", 8, 8)
    >>> hair = bpy.data.objects["Hair"].data
    >>> api.shade(hair, color=(0.3, 0.2, 0.1))
    >>> api.set_map(hair, "look.color", coat).source
    'Coat'
    """
    target = _editable(hair, setting)
    if isinstance(source, str):
        kind, name = varied_settings.parsed_source(source)
    elif getattr(getattr(source, "bl_rna", None), "identifier", "") == "Image":
        kind, name = "IMAGE", source.name
    else:
        raise HairError(f"source must be an image or text, not {described(source)}.")
    varied_settings.require_varied(setting)
    course = _course_of(target, setting)
    settings = changed(MapSettings, MapSettings(setting=setting, kind=kind, source=name, course=course), changes)
    varied_settings.require_map(settings)
    _require_style(target, setting)
    blender.settings.map_items.keep(target.vellus, settings)
    return settings


def set_course(hair: Curves, setting: str, curve: str = "") -> None:
    """Multiply a setting of a style by a curve from root to tip, such as "0:1 0.5:0.3 1:0". Empty text removes it.

    setting: such as "styles.Curl.radius" of the style with the name Curl; a map of the setting stays. curve: points as
    for `set_thickness_curve`.

    >>> hair = bpy.data.objects["Hair"].data
    >>> style = api.add_style(hair, "CURL")
    >>> api.set_course(hair, "styles.Curl.radius", "0:0 0.3:1 1:0.4")
    >>> [one.course for one in api.maps_of(hair) if one.setting == "styles.Curl.radius"]
    ['0:0 0.3:1 1:0.4']
    >>> api.set_course(hair, "styles.Curl.radius")
    """
    target = _editable(hair, setting)
    if not isinstance(curve, str):
        raise HairError(f"curve must be text, not {described(curve)}.")
    ramp_text.require_curve(curve)
    varied_settings.require_course(setting)
    _require_style(target, setting)
    items = blender.settings.map_items
    item = items.item_of(target.vellus, setting)
    if item is None and curve:
        item = items.add(target.vellus, setting)
    if item is not None:
        items.set_course(item, curve)
        if not curve and not items.is_set(item):
            items.remove(target.vellus, setting)


def _course_of(target, setting):
    """Return the curve from root to tip of a setting as text, which is empty without a curve."""
    item = blender.settings.map_items.item_of(target.vellus, setting)
    return "" if item is None else blender.settings.ramp_nodes.text_of(item.course_tree)


def _require_style(target, setting):
    """Raise `HairError` if a setting is of a style that hair Curves do not have, or that maps cannot vary."""
    name, of_style = varied_settings.style_of(setting)
    if not name:
        return
    items = blender.settings.style_items
    styles = dict(zip(items.names_of(target.vellus), items.styles_of(target.vellus), strict=True))
    if name not in styles or varied_settings.details_of_style(styles[name], of_style) is None:
        sentence = 'The hair has no style "{name}" with a setting "{setting}": use the name and a setting of a style.'
        raise HairError(sentence, name=name, setting=of_style)


def maps_of(hair: Curves) -> tuple[MapSettings, ...]:
    """Return the maps of hair Curves and of their guides.

    >>> [each.setting for each in api.maps_of(bpy.data.objects["Hair"])]
    ['look.color']
    """
    return blender.groom.transfer.groom_settings.maps_of(blender.data.arguments.curves_of(hair, "HAIR"))


def clear_map(hair: Curves, setting: str) -> bool:
    """Remove the map of a setting, and keep its curve from root to tip; returns whether there was a map.

    >>> api.clear_map(bpy.data.objects["Hair"], "look.color")
    True
    """
    varied_settings.require_varied_or_course(setting)
    return blender.settings.map_items.clear(_editable(hair, setting).vellus, setting)


def set_thickness_curve(hair: Curves, curve: str = "") -> None:
    """Set the thickness of hair Curves from root to tip by a curve, such as "0:1 0.5:0.3 1:0.2"; empty: remove it.

    Each point is POSITION:VALUE from 0 to 1, where 1 is the tip and the full thickness; POSITION:VALUE:auto rounds the
    curve at the point.

    >>> hair = bpy.data.objects["Hair"]
    >>> api.set_thickness_curve(hair, "0:1 0.8:0.9 1:0.1")
    >>> api.thickness_curve_of(hair)
    '0:1 0.8:0.9 1:0.1'
    >>> api.set_thickness_curve(hair)
    """
    target = _editable(hair)
    if not isinstance(curve, str):
        raise HairError(f"curve must be text, not {described(curve)}.")
    blender.groom.transfer.groom_settings.assign_thickness_curve(target, curve)


def thickness_curve_of(hair: Curves) -> str:
    """Return the thickness curve of hair Curves; empty without one.

    >>> api.thickness_curve_of(bpy.data.objects["Hair"])
    ''
    """
    return blender.settings.ramp_nodes.text_of(blender.data.arguments.curves_of(hair, "HAIR").vellus.thickness_ramp)


def _editable(hair, setting=""):
    """Return the Curves that have a setting: the hair, or its guides. Raises `HairError`."""
    target = blender.data.arguments.curves_of(hair, "HAIR")
    if varied_settings.is_of_guides(setting):
        target = blender.groom.pipeline.inputs_of(target)[0]
    blender.data.strands.curves.require_editable(target)
    return target
