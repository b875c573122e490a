# SPDX-License-Identifier: GPL-3.0-or-later
"""The choice of a placement of cards: the one with the least error of several."""

from dataclasses import replace

import numpy as np

from ..long_work import Progress
from .card_error import CardError, Comparison
from .card_layout import CardStrands, Placement, laid_cards, texture_segments
from .card_settings import CardSettings, Level
from .texels import TexelSums

_PER_SIDE = 2  # samples along each side of a texel
_TEXTURE_SIZE = 1024  # most texels along a side of the textures of trials
_CROSSED = (0.4, 1.0)
_OUTWARD = (0.5, 8.0)
_TIP = (0.5, 2.0)


def best_placement(
    comparison: Comparison, strands: CardStrands, level: Level, settings: CardSettings, progress: Progress
) -> tuple[CardSettings, Placement]:
    """Return (settings, placement) with the least error for the number of cards of a level.

    One parameter after the other is varied: the part of crossed cards, unless the settings have one, the weight of
    facing outward, and the weight of tips. All trials have the same number of cards. Raises `HairError`.
    """
    level = replace(level, texture_size=min(level.texture_size, _TEXTURE_SIZE))
    steps = [("outward", value) for value in _OUTWARD] + [("tip", value) for value in _TIP]
    if settings.crossed == 0.0:
        steps = [("crossed", value) for value in _CROSSED] + steps
    best, least = (settings, Placement()), None
    for index, step in enumerate([None, *steps]):
        progress("Comparing placements of cards", index / (len(steps) + 1))
        trial = _changed(best, step)
        error = placement_error(comparison, strands, level, *trial)
        if least is None or error.mean < least:
            best, least = trial, error.mean
    return best


def _changed(choice, step):
    """Return (settings, placement) with a parameter changed: (name, value), or None for no change."""
    if step is None:
        return choice
    settings, placement = choice
    name, value = step
    if name == "crossed":
        return replace(settings, crossed=value), placement
    return settings, replace(placement, **{name: value})


def placement_error(
    comparison: Comparison, strands: CardStrands, level: Level, settings: CardSettings, placement: Placement
) -> CardError:
    """Return the error of cards whose textures are drawn by the processor."""
    laid, size = laid_cards(strands, level, settings, placement), level.texture_size
    sums = TexelSums(size)
    sums.add(texture_segments(laid.strands, size, _PER_SIDE), laid.strands, _PER_SIDE, np.zeros(2), range(size))
    return comparison.error_of(laid.mesh, sums.maps())
