# SPDX-License-Identifier: GPL-3.0-or-later
"""Wetness of strands by the map of the look's *Wetness*."""

import numpy as np
from bpy.types import Curves

from ...core.errors import HairError
from ...core.maps import varied_settings
from ...core.styling import program
from ..data.maps import ramps, sources
from ..data.strands import attributes, curves
from ..materials import looks
from ..settings import map_items, properties, shared_wetness
from . import strand_thickness
from .bindings import BoundHair


def read(hair: Curves, bound: BoundHair) -> tuple[np.ndarray | None, str]:
    """Return (wetness (S,) float32 of bound hair by its map and its styles, a sentence about a missing source of the
    map); None without a map.
    """
    item = shared_wetness.map_of(hair.vellus)
    if item is None:
        return None, ""
    found, status = _of_strands(hair, item, strand_thickness.strands_of(hair, bound))
    of_styles = bound.styles.wetness
    soaked = np.float32(program.wetness(bound.styles.read.styles)) if of_styles is None else of_styles
    return np.maximum(found, soaked), status


def _of_strands(hair, item, strands):
    """Return (wetness (S,) float32 of strands by the map of a hair's look, a sentence about a missing source)."""
    value = properties.own_look_of(hair.vellus).wetness
    details = varied_settings.all_varied()[shared_wetness.SETTING][1]
    settings, ramp = map_items.settings_of(item), ramps.map_samples(item, False)
    try:
        return sources.varied_numbers(strands, settings, item.image, value, details, ramp).astype(np.float32), ""
    except HairError as error:
        return np.full(len(strands.randoms), value, np.float32), str(error)


def follow_kept(hair: Curves, status: str) -> bool:
    """Give kept hair the wetness of its map; returns whether it has a map.

    status: of the hair by other maps; without any, a sentence about a missing source becomes the status of the hair.
    """
    item = shared_wetness.map_of(hair.vellus)
    if item is None or attributes.is_from_library(hair) or not len(hair.curves):
        return False
    wetness, of_map = _of_strands(hair, item, sources.stored_strands(hair))
    if curves.write_wetness(hair, wetness):
        looks.evaluate_shading(hair)
    hair.vellus.status, hair.vellus.is_stale = status or of_map, False
    return True
