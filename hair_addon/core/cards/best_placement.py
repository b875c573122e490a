# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of the placement of cards with the least error, then exchanges of single cards."""

from dataclasses import replace

import numpy as np

from ..geometry.search import clusters
from ..long_work import Progress, no_progress, part_of
from .card_error import CardError, Comparison
from .card_exchange import exchanged
from .card_layout import CardStrands, Placement, clumps_of, laid_cards, texture_segments
from .card_settings import CardSettings, Level
from .card_views import side_toward
from .strand_sample import of_all, sample_of
from .texels import TexelSums

SAMPLES = 384  # along each side of the views of trials
_TEXTURE_SIZE = 512  # maximum number of texels along a side of the textures of trials
_CROSSED = (0.4, 1.0)
_OUTWARD = (0.5, 8.0)
_TIP = (0.5, 2.0)
_FIRST_EXCHANGE = 6  # the first trial exchanges one of this many cards
MOST_EXCHANGES = 12  # maximum number of trials
HELD_SIDES = np.array([side_toward((0.8, -0.5, 0.35)), side_toward((-0.6, 0.7, 0.1))])


class Trials:
    """Comparisons for the choice of placements: with a sample of the strands, and with all strands.

    comparison: with all strands; card_count: the largest number of cards. Both have views from other sides too, which
    confirm what lowers the error.
    """

    def __init__(
        self, strands: CardStrands, comparison: Comparison, card_count: int, progress: Progress = no_progress
    ) -> None:
        self.strands, self.sample = strands, sample_of(strands, card_count)
        self.seen = Comparison(self.sample.strands, progress, SAMPLES)
        self.held = Comparison(self.sample.strands, progress, SAMPLES, HELD_SIDES)
        self._of_all = comparison, Comparison(strands, progress, SAMPLES, HELD_SIDES)

    def errors_of_all(self, level: Level, settings: CardSettings, placement: Placement) -> np.ndarray:
        """Return the errors (2,) from the sides of the search and from the others; placement: of all strands."""
        drawn = _drawn(self.strands, level, settings, placement)
        return np.array([comparison.error_of(*drawn).mean for comparison in self._of_all])


def best_placement(
    trials: Trials, level: Level, settings: CardSettings, progress: Progress
) -> tuple[CardSettings, Placement]:
    """Return (settings, placement) with the least error for the number of cards of a level.

    The search uses the sample. It varies one parameter after the other: the part of crossed cards, unless the settings
    have one, the weight of facing outward, and the weight of tips. Then it exchanges single cards while the error
    falls. All trials have the same number of cards. The errors of all strands, from the sides of the search and from
    others, are not larger than those of the default. Raises `HairError`.
    """
    level = replace(level, texture_size=min(level.texture_size, _TEXTURE_SIZE))
    strands, default = trials.sample.strands, (settings, Placement())
    steps = [("outward", value) for value in _OUTWARD] + [("tip", value) for value in _TIP]
    if settings.crossed == 0.0:
        steps = [("crossed", value) for value in _CROSSED] + steps
    best, least = default, None
    trial_count = len(steps) + 1 + MOST_EXCHANGES
    for index, step in enumerate([None, *steps]):
        progress("Comparing placements of cards", 0.8 * index / trial_count)
        trial = _changed(best, step)
        error = placement_error(trials.seen, strands, level, *trial)
        if least is None or error.mean < least:
            best, least = trial, error.mean

    def exchange_progress(index):
        progress("Exchanging cards", 0.8 * (1.0 - (MOST_EXCHANGES - index) / trial_count))

    chosen, placement = best
    exchanged_cards = _exchanging(trials, level, chosen, placement, exchange_progress)
    choices = [best]
    if exchanged_cards is not None:
        choices.insert(0, (chosen, of_all(exchanged_cards, trials.strands, trials.sample.rows)))
    return _confirmed(trials, level, default, choices, part_of(progress, 0.8, 1.0))


def _confirmed(trials, level, default, choices, progress):
    """Return the first of choices that has no larger errors of all strands than the default, else the default."""
    most = None
    for index, choice in enumerate([default, *choices]):
        progress("Comparing all strands", index / (1 + len(choices)))
        if index and choice == default:
            break
        errors = trials.errors_of_all(level, *choice)
        if most is None:
            most = errors
        elif (errors <= most).all():
            return choice
    return default


def _changed(choice, step):
    """Return (settings, placement) with a parameter changed: (name, value), or None for no change."""
    if step is None:
        return choice
    settings, placement = choice
    name, value = step
    if name == "crossed":
        return replace(settings, crossed=value), placement
    return settings, replace(placement, **{name: value})


def _exchanging(trials, level, settings, placement, progress):
    """Return the placement of the sample after the exchanges of cards that lower its errors from all sides, or None."""
    strands = trials.sample.strands
    features = clusters.strand_features(strands.points)

    def measured(clumps, most=np.inf):
        trial = replace(placement, clumps=clumps)
        drawn = _drawn(strands, level, settings, trial)
        error, shares = trials.seen.shares_of(*drawn, level.segment_count, clumps.labels)
        held = trials.held.error_of(*drawn).mean if error.mean < most else np.inf
        return trial, np.array([error.mean, held]), shares

    best, least, shares = measured(clumps_of(strands, level, settings, placement))
    most, is_better = -(-level.card_count // _FIRST_EXCHANGE), False
    for index in range(MOST_EXCHANGES - 1):
        progress(index)
        trial, errors, its_shares = measured(exchanged(features, best.clumps, shares, most), least[0])
        if (errors < least).all():
            best, least, shares, is_better = trial, errors, its_shares, True
        elif most == 1:
            break
        else:
            most //= 2
    return best if is_better else None


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
