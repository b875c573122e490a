# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of settings that are painted on the surface with Blender's brushes."""

import contextlib
from typing import Any

import bpy
import numpy as np
from bpy.types import Context, Curves

from ....core.errors import HairError
from ....core.maps import varied_settings
from ...data.maps import new_sources
from ...data.strands import curves
from ...host.notices import name_of
from ...settings import map_items, properties, style_items
from . import painted_masks

# Kinds of maps that can be painted: their paint modes.
MODES = {"IMAGE": "TEXTURE_PAINT", "GROUP": "WEIGHT_PAINT", "ATTRIBUTE": "VERTEX_PAINT"}


def paint(hair: Curves, item: map_items.VellusMap, context: Context) -> None:
    """Enter the paint mode of a map's source on the surface of hair; creates a source for a map without one.

    item: of the map. A new source has the color of the setting, or is white for a number. Raises `HairError` before
    anything changes.
    """
    curves.require_editable(hair)
    surface = curves.grown_on(hair)
    painted_masks.require_paintable(surface, context)
    if item.kind not in MODES:
        raise HairError("Only images, vertex groups and attributes of the surface can be painted: change the kind.")
    uv_map = _uv_map(surface, item.uv) if item.kind == "IMAGE" else None
    attribute = _attribute(surface, item.source) if item.kind == "ATTRIBUTE" else None
    if item.kind == "IMAGE" and item.image is not None:
        curves.require_editable(item.image)
    is_color, color = _is_colored(item), _first_color(hair, item)
    with contextlib.ExitStack() as undo:
        source: Any
        if item.kind == "IMAGE":
            name = "" if item.image is not None else _new_name(hair, item)
            source = item.image or new_sources.new_image(name, color, is_color)
            if name:
                undo.callback(bpy.data.images.remove, source)
            painted_masks.set_canvas(source, context)
            surface.data.uv_layers.active = uv_map
        elif item.kind == "GROUP":
            name = item.source or _new_name(hair, item)
            group = surface.vertex_groups.get(name)
            if group is None:
                group = new_sources.new_group(surface, name)
                undo.callback(surface.vertex_groups.remove, group)
            surface.vertex_groups.active, source = group, group.name
        else:
            if attribute is None:
                attribute = new_sources.new_attribute(surface.data, _new_name(hair, item), color)
                undo.callback(surface.data.color_attributes.remove, attribute)
            surface.data.color_attributes.active_color, source = attribute, name_of(attribute)
        painted_masks.enter(surface, MODES[item.kind], context)
        setattr(item, "image" if item.kind == "IMAGE" else "source", source)
        undo.pop_all()


def _is_colored(item):
    """Return whether the colors of a map are those of the setting; a color ramp needs numbers."""
    return varied_settings.is_color(item.setting) and item.ramp_tree is None


def _first_color(hair, item):
    """Return the color (3,) of a new source, scene-linear."""
    if not _is_colored(item):
        return np.ones(3)
    _section, _, name = item.setting.partition(".")
    return np.array(getattr(properties.own_look_of(hair.vellus), name))


def _uv_map(surface, name):
    """Return the UV map with a name; the active one for an empty name. Raises `HairError`."""
    layers = surface.data.uv_layers
    found = layers.get(name) if name else layers.active
    if found is None and name:
        sentence = '"{name}" has no UV map "{uv}": pick another UV map.'
        raise HairError(sentence, name=name_of(surface), uv=name)
    if found is None:
        raise HairError('"{name}" has no UV map for the images of its hair: create one.', name=name_of(surface))
    return found


def _attribute(surface, name):
    """Return the color attribute with a name; None for an empty name. Raises `HairError` for other attributes."""
    if not name:
        return None
    found = surface.data.color_attributes.get(name)
    if found is None:
        sentence = '"{name}" has no color attribute "{attribute}" to paint: clear the field for a new attribute.'
        raise HairError(sentence, name=name_of(surface), attribute=name)
    return found


def _new_name(hair, item):
    """Return a name after the setting, such as "Color Map", that no image and no source on the surface has."""
    surface = curves.grown_on(hair)
    name = item.setting.rpartition(".")[2].replace("_", " ").title()
    owners = (surface.data.attributes, surface.vertex_groups, bpy.data.images)
    return style_items.unique_name(f"{name} Map", {name_of(entry) for owner in owners for entry in owner})
