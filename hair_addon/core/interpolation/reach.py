# SPDX-License-Identifier: GPL-3.0-or-later
"""The strands that go with each guide, or with each of other groups: those that move when some of them do."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .guide_weights import GuideWeights


@dataclass(frozen=True)
class Reach:
    """The strands that follow each guide, as compressed rows: guide g's are strands[starts[g]:starts[g + 1]]."""

    starts: np.ndarray  # (G+1,) int64
    strands: np.ndarray  # int32

    @cached_property
    def _strand_count(self):
        return int(self.strands.max(initial=-1)) + 1

    def of(self, guides: np.ndarray) -> np.ndarray:
        """Indices, rising, of the strands that follow any of some guides."""
        is_reached = np.zeros(self._strand_count, bool)
        if len(guides) == len(self.starts) - 1:
            is_reached[self.strands] = True
            return np.flatnonzero(is_reached)
        for guide in guides:
            is_reached[self.strands[self.starts[guide] : self.starts[guide + 1]]] = True
        return np.flatnonzero(is_reached)


def of_guides(guide_weights: "GuideWeights", guide_count: int) -> Reach:
    """The `Reach` of guides, from the `GuideWeights` of the strands that follow them."""
    return of_groups(guide_weights.indices.numpy(), guide_count)


def of_groups(indices: np.ndarray, guide_count: int) -> Reach:
    """The `Reach` of guides, or whatever else strands go with: indices (S, k) int32 of those of each, -1 for none."""
    # Sorted as one number each, guide and then strand: four times as fast as by an order of indices.
    pairs = (indices.astype(np.int64) << 32) | np.arange(len(indices))[:, None]
    pairs = np.sort(pairs[indices >= 0])
    starts = np.searchsorted(pairs, np.arange(guide_count + 1) << 32)
    return Reach(starts, pairs.astype(np.int32))
