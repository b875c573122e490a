# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of styles, such as the radius of curls, that maps vary between strands, or curves from root to tip."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from bpy.types import Curves, Object

from ...core.errors import HairError
from ...core.geometry.mesh import SurfacePoints
from ...core.maps import combination, varied_settings
from ...core.params import Param
from ...core.styling import lean, program, wet
from ...core.styling.base import StyleSettings
from ...core.styling.courses import are_same as are_same_courses
from ...core.styling.varied_numbers import NumberMap
from ..data.maps import ramps, sources
from ..data.surfaces import Surface
from ..settings import map_items, style_items

_OF_PLACES = ("IMAGE", "GROUP", "ATTRIBUTE")  # strands of a lock share the values of these maps


@dataclass(frozen=True, eq=False)
class VariedNumber:
    """A setting of a style that a map or a curve varies: its value and its `Param`.

    source: `Source` of the map, or None; course: (N,) samples of the curve from root to tip, or None.
    """

    value: float
    details: Param
    source: sources.Source | None
    course: np.ndarray | None

    def is_same(self, other: "VariedNumber") -> bool:
        """Whether both give the same values at the same roots."""
        if self.source is None or other.source is None:
            is_same = self.source is other.source
        else:
            is_same = self.value == other.value and self.source.is_same(other.source)
        return is_same and are_same_courses(self.course, other.course)

    def number_map(self, source: sources.Source) -> NumberMap:
        """Return the `NumberMap` of the values of strands; source: the `Source` of the map."""

        def values(roots: SurfacePoints, identities: np.ndarray, clumps: np.ndarray | None) -> np.ndarray:
            masks = source.values(roots, identities, clumps)[:, 0]
            return combination.varied_number(self.value, masks, source.combination, self.details)

        return NumberMap(values, source.settings.kind in _OF_PLACES)


Numbers = Mapping[tuple[int, str], VariedNumber]  # by (index of the style, name of its setting)


def read(
    hair: Curves | None, surface_object: Object | None, surface: Surface, styles: Sequence[StyleSettings]
) -> tuple[Numbers, str]:
    """Return ({(index of the style, setting): `VariedNumber`} of hair, a sentence about a missing source or a map
    without an effect).

    hair: None if it is new; styles: of the hair, as Curves store them.
    """
    found, status = {}, ""
    names = () if hair is None else style_items.names_of(hair.vellus)
    for item in () if hair is None or len(names) != len(styles) else hair.vellus.maps:
        name, setting = varied_settings.style_of(item.setting)
        course = ramps.samples(item.course_tree)
        if not name or not (map_items.is_set(item) or course is not None):
            continue
        if name not in names:
            sentence = 'The map of "{setting}" has no effect: the hair has no style "{style}".'
            status = str(HairError(sentence, setting=item.setting, style=name))
            continue
        place = names.index(name)
        details = varied_settings.details_of_style(styles[place], setting)
        if details is None:
            continue
        source = None
        try:
            if course is not None and not details.has_course:
                course = None
                sentence = '"{setting}" cannot have a curve from root to tip: remove the curve.'
                raise HairError(sentence, setting=item.setting)
            if map_items.is_set(item):
                source = _source(item, hair, surface_object, surface, styles, place, details)
        except HairError as error:
            status = str(error)
        if source is not None or course is not None:
            value = getattr(styles[place], setting)
            found[place, setting] = VariedNumber(value, _limited(details, setting, value), source, course)
    return found, status


def _source(item, hair, surface_object, surface, styles, place, details):
    """Return the `Source` of a map of a style's setting. Raises `HairError`."""
    setting = varied_settings.style_of(item.setting)[1]
    settings = map_items.settings_of(item)
    if not details.may_vary:
        raise HairError('No map can vary "{setting}": use the mask of the style.', setting=item.setting)
    if not _has_values(settings.kind, styles[place], setting, details):
        raise HairError(_WITHOUT_VALUES, setting=item.setting)
    if settings.kind == "CLUMP" and not program.tree_levels(styles):
        raise HairError("There are no clumps for a random map: add the style Clump.")
    ramp = ramps.map_samples(item, False)
    return sources.read(hair, surface_object, surface, settings, item.image, ramp=ramp)


_WITHOUT_VALUES = 'Clumps and attributes of strands cannot vary "{setting}": pick another kind of map.'


def _has_values(kind, style, name, details):
    """Whether a kind of map has values where a style reads a number.

    Guides have no clumps and no values of strands, and sizes of locks are known before clumps.
    """
    is_of_guides = isinstance(style, lean.Settings) or (isinstance(style, wet.Settings) and name == "cling")
    return not (kind == "CLUMP" and (is_of_guides or details.is_structural)) and not (kind == "CURVES" and is_of_guides)


def _limited(details, name, value):
    """Return the `Param` of a setting, with a smallest value in place of zero for a setting that must be positive, or
    for which zero means no limit.
    """
    least = _LEAST_LOCK if details.is_structural else _LEAST
    may_be_zero = details.above == -np.inf and name != _UNLIMITED_AT_ZERO
    return details if may_be_zero else replace(details, low=least * value, above=-np.inf)


_UNLIMITED_AT_ZERO = "to_length"  # of the style Trim


_LEAST, _LEAST_LOCK = 1e-3, 0.1  # fractions of the setting; the second is for sizes of locks


def are_same(numbers: Numbers, others: Numbers) -> bool:
    """Return whether maps vary the same numbers of styles equally."""
    return numbers.keys() == others.keys() and all(found.is_same(others[key]) for key, found in numbers.items())


def number_maps(numbers: Numbers) -> dict[tuple[int, str], NumberMap]:
    """Return the `NumberMap` of each number that a map varies."""
    return {key: found.number_map(found.source) for key, found in numbers.items() if found.source is not None}


def courses(numbers: Numbers) -> dict[tuple[int, str], np.ndarray]:
    """Return the samples of the curve of each number that has one."""
    return {key: found.course for key, found in numbers.items() if found.course is not None}
