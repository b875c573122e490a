# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths of strands, as fractions of the full length, by the map of *Strand Length*."""

from collections.abc import Sequence

import numpy as np
from bpy.types import Curves, Object

from ...core.errors import HairError
from ...core.grooming.groom import HairSettings
from ...core.interpolation.hair_binding import HairBinding
from ...core.maps import combination, varied_settings
from ...core.styling import program
from ...core.styling.base import StyleSettings
from ...core.styling.masks import CutMask
from ..data.maps import ramps, sources
from ..data.surfaces import Surface
from ..settings import map_items

SETTING = "strands.strand_length"


def read(
    hair: Curves | None, surface_object: Object | None, surface: Surface, styles: Sequence[StyleSettings]
) -> tuple[sources.Source | None, str]:
    """Return (`Source` of the map of the length of hair, a sentence about a missing source); None without a map.

    hair: None if it is new; styles: of the hair.
    """
    item = None if hair is None else map_items.item_of(hair.vellus, SETTING)
    if hair is None or item is None or not map_items.is_set(item):
        return None, ""
    try:
        settings = map_items.settings_of(item)
        if settings.kind == "CLUMP" and not program.tree_levels(styles):
            raise HairError("There are no clumps for a random map: add the style Clump.")
        ramp = ramps.map_samples(item, False)
        return sources.read(hair, surface_object, surface, settings, item.image, ramp=ramp), ""
    except HairError as error:
        return None, str(error)


def cut_mask(length: sources.Source | None, settings: HairSettings) -> CutMask | None:
    """Return the `CutMask` of a map that varies the length of `HairSettings`; None without a map."""
    if length is None:
        return None
    details = varied_settings.all_varied()[SETTING][1]

    def fractions(binding: HairBinding, clumps: np.ndarray | None) -> np.ndarray:
        masks = length.values(binding.roots, binding.identities[0], clumps)[:, 0]
        return combination.varied_number(settings.strand_length, masks, length.combination, details)

    return CutMask(settings.strand_length, fractions)
