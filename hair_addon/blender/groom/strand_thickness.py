# SPDX-License-Identifier: GPL-3.0-or-later
"""Factors of the radii of bound hair by the map and the ramp of *Thickness*."""

import numpy as np
from bpy.types import Curves

from ...core.errors import HairError
from ...core.params import Param
from ..data.maps import ramps, sources
from ..data.strands import curves
from ..settings import map_items
from .bindings import BoundHair

SETTING = "strands.thickness"

_FACTOR = Param("", low=0.0, high=1e3)


def strands_of(hair: Curves, bound: BoundHair) -> sources.Strands:
    """Return the `Strands` of bound hair, which may be unwritten, for its maps."""
    clumps = bound.styles.clumps
    identities, randoms = bound.binding.identities
    return sources.Strands(
        hair,
        curves.grown_on(hair),
        bound.surface,
        bound.binding.roots,
        identities,
        randoms,
        None if clumps is None else clumps[0],
    )


def read(hair: Curves, bound: BoundHair) -> tuple[np.ndarray | None, str]:
    """Return (factors (S,) float32 of radii, a sentence about a missing source of the hair's maps); None without a
    map.
    """
    item, status = map_items.item_of(hair.vellus, SETTING), bound.styles.read.map_status
    if item is None or not map_items.is_set(item):
        return None, status
    try:
        return factors(strands_of(hair, bound), item), status
    except HairError as error:
        return None, str(error)


def factors(strands: sources.Strands, item: map_items.VellusMap) -> np.ndarray:
    """Return (S,) float32 factors of the radii of strands by a map. Raises `HairError` if its source is missing."""
    settings, ramp = map_items.settings_of(item), ramps.map_samples(item, False)
    return sources.varied_numbers(strands, settings, item.image, 1.0, _FACTOR, ramp).astype(np.float32)
