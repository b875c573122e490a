# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of the placement of cards with the least error, then exchanges of single cards."""

from dataclasses import replace

import numpy as np

from ..geometry.search import clusters
from ..long_work import Progress
from .card_error import CardError, Comparison
from .card_exchange import exchanged
from .card_layout import CardStrands, Placement, clumps_of, laid_cards, texture_segments
from .card_settings import CardSettings, Level
from .texels import TexelSums

SAMPLES = 384  # along each side of the views of trials
_TEXTURE_SIZE = 512  # maximum number of texels along a side of the textures of trials
_CROSSED = (0.4, 1.0)
_OUTWARD = (0.5, 8.0)
_TIP = (0.5, 2.0)
_FIRST_EXCHANGE = 6  # the first trial exchanges one of this many cards
MOST_EXCHANGES = 12  # maximum number of trials


def best_placement(
    comparison: Comparison, strands: CardStrands, level: Level, settings: CardSettings, progress: Progress
) -> tuple[CardSettings, Placement]:
    """Return (settings, placement) with the least error for the number of cards of a level.

    comparison: with the strands, `SAMPLES` samples wide. Parameters are varied one after the other: the part of crossed
    cards, unless the settings have one, the weight of facing outward, and the weight of tips. Then single cards are
    exchanged while the error falls. All trials have the same number of cards. Raises `HairError`.
    """
    level = replace(level, texture_size=min(level.texture_size, _TEXTURE_SIZE))
    steps = [("outward", value) for value in _OUTWARD] + [("tip", value) for value in _TIP]
    if settings.crossed == 0.0:
        steps = [("crossed", value) for value in _CROSSED] + steps
    best, least = (settings, Placement()), None
    trial_count = len(steps) + 1 + MOST_EXCHANGES
    for index, step in enumerate([None, *steps]):
        progress("Comparing placements of cards", index / trial_count)
        trial = _changed(best, step)
        error = placement_error(comparison, strands, level, *trial)
        if least is None or error.mean < least:
            best, least = trial, error.mean

    def exchange_progress(index):
        progress("Exchanging cards", 1.0 - (MOST_EXCHANGES - index) / trial_count)

    chosen, placement = best
    return chosen, _exchanging(comparison, strands, level, chosen, placement, exchange_progress)


def _changed(choice, step):
    """Return (settings, placement) with a parameter changed: (name, value), or None for no change."""
    if step is None:
        return choice
    settings, placement = choice
    name, value = step
    if name == "crossed":
        return replace(settings, crossed=value), placement
    return settings, replace(placement, **{name: value})


def _exchanging(comparison, strands, level, settings, placement, progress):
    """Return the placement after the exchanges of single cards that lower its error."""
    features = clusters.strand_features(strands.points)

    def measured(clumps):
        trial = replace(placement, clumps=clumps)
        mesh, maps = _drawn(strands, level, settings, trial)
        return trial, *comparison.shares_of(mesh, maps, level.segment_count, clumps.labels)

    best, least, shares = measured(clumps_of(strands, level, settings, placement))
    most = -(-level.card_count // _FIRST_EXCHANGE)
    for index in range(MOST_EXCHANGES - 1):
        progress(index)
        trial, error, its_shares = measured(exchanged(features, best.clumps, shares, most))
        if error.mean < least.mean:
            best, least, shares = trial, error, its_shares
        elif most == 1:
            break
        else:
            most //= 2
    return best


def placement_error(
    comparison: Comparison, strands: CardStrands, level: Level, settings: CardSettings, placement: Placement
) -> CardError:
    """Return the error of cards whose textures are drawn by the processor."""
    return comparison.error_of(*_drawn(strands, level, settings, placement))


def _drawn(strands, level, settings, placement):
    """Return (mesh, maps) of cards, with one sample for each texel."""
    laid, size = laid_cards(strands, level, settings, placement), level.texture_size
    sums = TexelSums(size)
    sums.add(texture_segments(laid.strands, size, 1), laid.strands, 1, np.zeros(2), range(size))
    return laid.mesh, sums.maps()
