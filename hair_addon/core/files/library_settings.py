# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a groom that leaves its scene: scaled to another surface, without references to other data."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from ..params import Settings, declared
from .settings_file import GroomSettings

S = TypeVar("S", bound=Settings)

# Settings that name an object or an image of the scene: of each section, and of styles.
_NAMES_OF_OTHERS = {"guides": ("density_image", "flow_lines"), "hair": ("density_image", "part_lines")}
_NAMES_OF_OTHERS_IN_STYLES = ("mask_image", "cutter", "target", "center_guides")
_OTHER_MAPS = ("IMAGE", "CURVES")  # kinds of maps with the name of an image, or of an attribute of strands
_MASK_MAPS = ("GROUP", "ATTRIBUTE")  # kinds of maps with the name of a mask
_MASKS = {"guides": ("density_group",), "hair": ("density_group", "region_group")}


def scaled(settings: GroomSettings, factor: float) -> GroomSettings:
    """Return `GroomSettings` with all lengths of guides, strands, styles and dynamics multiplied by a factor."""
    if factor == 1.0:
        return settings
    sections = {name: _scaled(getattr(settings, name), factor) for name in ("guides", "hair", "dynamics")}
    return replace(settings, **sections, styles=tuple(_scaled(style, factor) for style in settings.styles))


def _scaled(settings: S, factor: float) -> S:
    lengths = {
        name: min(max(value * factor, details.low), details.high)
        for name, details, value in ((n, d, getattr(settings, n)) for n, _default, d in declared(type(settings)))
        if details.unit == "LENGTH" and value is not None
    }
    return replace(settings, **lengths)


def alone(settings: GroomSettings) -> tuple[GroomSettings, list[str]]:
    """Return `GroomSettings` without the names of other objects and images, and the list of these names."""
    left: list[str] = []
    sections = {
        section: _without(getattr(settings, section), names, left) for section, names in _NAMES_OF_OTHERS.items()
    }
    styles = tuple(_without(style, _NAMES_OF_OTHERS_IN_STYLES, left) for style in settings.styles)
    left += [one.source for one in settings.maps if one.kind in _OTHER_MAPS and one.has_source]
    return replace(settings, **sections, styles=styles, maps=_without_sources(settings.maps, _OTHER_MAPS)), left


def _without_sources(maps, kinds):
    """Return maps, of some kinds only their curves from root to tip."""
    kept = (one.without_source if one.kind in kinds else one for one in maps)
    return tuple(one for one in kept if one.has_source or one.course)


def _without(settings, names, left):
    present = [name for name in names if getattr(settings, name, "")]
    left += [getattr(settings, name) for name in present]
    return replace(settings, **dict.fromkeys(present, "")) if present else settings


def masks_of(settings: GroomSettings) -> list[str]:
    """Return the unique names of masks in `GroomSettings`: vertex groups, and attributes of styles and maps."""
    found = [getattr(getattr(settings, section), name) for section, names in _MASKS.items() for name in names]
    found += [style.mask for style in settings.styles]
    found += [one.source for one in settings.maps if one.kind in _MASK_MAPS]
    return list(dict.fromkeys(filter(None, found)))


def renamed(settings: GroomSettings, names: Mapping[str, str]) -> GroomSettings:
    """Return `GroomSettings` with renamed masks; names: {old: new}, "" removes a mask and its maps."""
    maps = (
        replace(one, source=names.get(one.source, one.source)) if one.kind in _MASK_MAPS else one
        for one in settings.maps
    )
    maps = tuple(found for one in maps for found in ((one,) if one.source else _without_sources((one,), _MASK_MAPS)))
    sections = {section: _renamed(getattr(settings, section), masks, names) for section, masks in _MASKS.items()}
    styles = tuple(_renamed(style, ("mask",), names) for style in settings.styles)
    return replace(settings, **sections, styles=styles, maps=maps)


def _renamed(settings, masks, names):
    return replace(settings, **{mask: names.get(getattr(settings, mask), getattr(settings, mask)) for mask in masks})
