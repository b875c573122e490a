# SPDX-License-Identifier: GPL-3.0-or-later
"""A sample of the strands of cards, on which placements are tried, and clumps of all strands from those of a sample."""

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.search import clusters
from .card_layout import CardStrands, Clumps, Placement

MOST_STRANDS = 3_000
MOST_POINTS = 24  # of each strand
_PER_CARD = 4  # strands at least, if there are as many


@dataclass(frozen=True)
class StrandSample:
    """Some of the strands, wider so that they cover as much as all strands, and their ascending indices `rows` (N,)."""

    strands: CardStrands
    rows: np.ndarray


def sample_of(strands: CardStrands, card_count: int) -> StrandSample:
    """Return at most max(3,000, 4 · card_count) of the strands, with at most 24 points each. Deterministic.

    Strands are drawn from equal parts of their order, at random: a fixed step could always meet the middle of a lock.
    """
    count, points = strands.points.shape[:2]
    part_count = min(count, max(MOST_STRANDS, _PER_CARD * card_count))
    edges = np.arange(part_count + 1) * count // part_count
    rows = np.random.default_rng(0).integers(edges[:-1], edges[1:])
    chosen = np.ix_(rows, np.linspace(0, points - 1, min(points, MOST_POINTS)).round().astype(int))
    wider = strands.radii.dtype.type(count / len(rows))
    colors = strands.colors[chosen]
    return StrandSample(
        CardStrands(strands.points[chosen], wider * strands.radii[chosen], colors, strands.surface), rows
    )


def of_all(placement: Placement, strands: CardStrands, rows: np.ndarray) -> Placement:
    """Return a placement of all strands; placement: of those in `rows`. The others join the most similar clump."""
    clumps = placement.clumps
    if clumps is None:
        return placement
    features, inner = clusters.strand_features(strands.points), clumps.labels >= 0
    middles = clusters.cluster_means(features[rows[inner]], clumps.labels[inner], clumps.count)
    labels = clusters.nearest(features, middles)
    labels[rows] = clumps.labels
    return replace(placement, clumps=Clumps(labels, clumps.crossed))
