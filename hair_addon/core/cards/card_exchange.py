# SPDX-License-Identifier: GPL-3.0-or-later
"""Exchange of cards: more cards where they differ from the strands, fewer where they are hardly visible."""

import numpy as np

from ..geometry.search import clusters
from .card_error import CardShares
from .card_layout import Clumps


def exchanged(features: np.ndarray, clumps: Clumps, shares: CardShares, most: int) -> Clumps:
    """Return clumps with the same number of cards, after moving up to `most` cards from some clumps to others.

    features: (S, D) of strands, to compare clumps; shares: of the first cards of clumps, then of second cards. The
    clumps with the largest error get a second card, or are divided if they have one. The least visible cards are
    removed: second cards, or cards whose clump joins the most similar one.
    """
    count = clumps.count
    seconds = np.full(count, -1)
    seconds[clumps.crossed] = count + np.arange(len(clumps.crossed))
    is_crossed = seconds >= 0
    inner = clumps.labels >= 0
    sizes = np.bincount(clumps.labels[inner], minlength=count)
    errors = shares.errors[:count].copy()
    errors[clumps.crossed] += shares.errors[seconds[clumps.crossed]]
    takers = np.argsort(-errors, kind="stable")
    takers = takers[~is_crossed[takers] | (sizes[takers] > 1)][:most]
    middles = clusters.cluster_means(features[inner], clumps.labels[inner], count)
    joined, without_second = _removals(middles, is_crossed, shares.seen, seconds, takers)
    takers = takers[: len(joined) + len(without_second)]
    labels, second = clumps.labels.copy(), is_crossed.copy()
    second[takers] = True
    second[without_second] = False
    for clump in takers[is_crossed[takers]]:
        rows = np.flatnonzero(labels == clump)
        labels[rows[clusters.clusters(features[rows], 2) == 1]] = len(second)
        second = np.append(second, False)
    for clump, other in joined.items():
        labels[labels == clump] = other
    kept = np.setdiff1d(np.arange(len(second)), list(joined))
    renamed = np.full(len(second) + 1, -1, np.int32)  # the last entry is for -1
    renamed[kept] = np.arange(len(kept))
    return Clumps(renamed[labels], np.flatnonzero(second[kept]))


def _removals(middles, is_crossed, seen, seconds, takers):
    """Return ({clump: the clump that it joins}, [clumps that lose their second card]), at most one for each taker.

    middles: (C, D) features of clumps; seen: visible samples of cards; seconds: (C,) index of second cards;
    takers: clumps that stay.
    """
    joined, without_second, is_free = {}, [], np.ones(len(middles), bool)
    is_free[takers] = False
    visible = np.where(is_crossed, seen[seconds], seen[: len(middles)])
    for clump in np.argsort(visible, kind="stable"):
        if len(joined) + len(without_second) == len(takers):
            break
        if not is_free[clump]:
            continue
        if is_crossed[clump]:
            without_second.append(clump)
            continue
        apart = ((middles - middles[clump]) ** 2).sum(axis=1)
        apart[~is_free] = np.inf
        apart[clump] = np.inf
        other = int(np.argmin(apart))
        if np.isfinite(apart[other]):
            joined[int(clump)] = other
            is_free[[clump, other]] = False
    return joined, np.array(without_second, int)
