# SPDX-License-Identifier: GPL-3.0-or-later
"""Sites of clumps in levels, and the strands that belong to each.

Sites are evenly placed on the surface and are not roots of the hair: a strand's clump depends on its own root alone,
whichever other strands there are. A strand belongs to the nearest site of the finest level, and a site to the nearest
one of the next coarser level, so locks are made of whole smaller locks. One in a region without sites belongs to none.
"""

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import interpolation
from ..geometry.mesh import SurfacePoints
from ..interpolation.hair_binding import HairBinding
from ..interpolation.root_binder import RootBinder
from ..kernels.checks import require_indices
from ..long_work import Progress, no_progress, part_of
from .base import TreeSettings
from .random_numbers import CROSSOVER, random_numbers

MOST_SITES = 20_000  # of the finest level: they take a second to place, and 50,000 on two levels seven
MOST_SPARE = 2  # trees that no style uses at present: of a slider that goes back, of a style switched off and on
_HEXAGON = 0.866  # area of a site's cell by the square of the distance between sites

HAIR = "hair"  # what the strands of the hair are known by; centres are by their tree and level
Owner = str | tuple[TreeSettings, int]


def site_count(area: float, size: float) -> int:
    """Number of sites at a distance [m] from each other on an area [m²]."""
    return max(round(area / (_HEXAGON * size**2)), 1)


def size_factor(area: float, tree: TreeSettings) -> float:
    """What the sizes of a tree are multiplied by on an area [m²], so that no level has more than `MOST_SITES`."""
    return max(math.sqrt(area / (_HEXAGON * MOST_SITES)) / min(tree.sizes), 1.0)


@dataclass
class ClumpTrees:
    """The clump trees of one hair, each searched for once, while its surface, guides' roots and density stay.

    binder: binds sites to guides; place(count, seed, progress): `SurfacePoints` of evenly placed sites; area: that hair
    grows on [m²].
    """

    binder: RootBinder
    place: Callable[[int, int, Progress], SurfacePoints]
    area: float
    _levels: dict[TreeSettings, list[HairBinding]] = field(default_factory=dict)
    _members: dict[tuple[Owner, TreeSettings], list[np.ndarray]] = field(default_factory=dict)
    _parents: dict[tuple[TreeSettings, int], np.ndarray] = field(default_factory=dict)

    def levels(self, tree: TreeSettings, progress: Progress = no_progress) -> list[HairBinding]:
        """The centres of each level, the coarsest first, bound to guides.

        progress(step, part): told while they are placed, and may raise to stop: then nothing of the tree is kept.
        """
        if tree not in self._levels:
            counts = self.site_counts(tree)
            ends = [0.0, *(sum(counts[: level + 1]) / sum(counts) for level in range(len(counts)))]
            self._levels[tree] = [
                self.binder.bind(self.place(count, tree.seed + level, part_of(progress, ends[level], ends[level + 1])))
                for level, count in enumerate(counts)
            ]
        else:
            self._levels[tree] = self._levels.pop(tree)  # used last
        return self._levels[tree]

    def site_counts(self, tree: TreeSettings) -> list[int]:
        """Number of sites of each level, the coarsest first."""
        factor = size_factor(self.area, tree)
        return [site_count(self.area, factor * size) for size in tree.sizes]

    def search(self, trees: Collection[TreeSettings], progress: Progress = no_progress) -> None:
        """Find the centres of some trees that were not searched for yet; progress as in `levels`."""
        missing = self.lacks(trees)
        for place, tree in enumerate(missing):
            self.levels(tree, part_of(progress, place / len(missing), (place + 1) / len(missing)))

    def lacks(self, trees: Collection[TreeSettings]) -> list[TreeSettings]:
        """Those of some trees that were not searched for yet, each once."""
        return [tree for tree in dict.fromkeys(trees) if tree not in self._levels]

    def keep_only(self, used: Collection[TreeSettings]) -> None:
        """Forget trees that are not among the used ones, but for the last `MOST_SPARE`.

        Otherwise every value of a slider would leave a tree behind.
        """
        spare = [tree for tree in self._levels if tree not in used]
        for tree in spare[: max(len(spare) - MOST_SPARE, 0)]:
            del self._levels[tree]
        # Which copies of these trees for other weights share: what one of them forgets, another finds again.
        for owner, tree in list(self._members):
            named = {tree} if isinstance(owner, str) else {tree, owner[0]}
            if not named <= self._levels.keys():
                del self._members[owner, tree]
        for tree, level in list(self._parents):
            if tree not in self._levels:
                del self._parents[tree, level]

    def weigh_again(self, settings: Any) -> "ClumpTrees":
        """The same trees where weights, limits or lengths of `HairSettings` changed: nothing is searched."""
        weighed = {
            tree: [interpolation.hair_binding.weigh_again(binding, settings) for binding in levels]
            for tree, levels in self._levels.items()
        }
        return ClumpTrees(
            self.binder.with_settings(settings), self.place, self.area, weighed, self._members, self._parents
        )

    def members(self, owner: Owner, strands: HairBinding, tree: TreeSettings) -> list[np.ndarray]:
        """(S,) int32 per level, the coarsest first: the place of each strand's centre in its level, -1 for none.

        owner: what the strands are known by.
        """
        key = owner, tree
        if key not in self._members:
            nearest = self._nearest(strands, self.levels(tree)[-1])
            if tree.crossover > 0.0:
                crosses = random_numbers(strands.identities[0], tree.seed, CROSSOVER) < tree.crossover
                crosses &= nearest[:, 1] >= 0
                nearest[crosses, 0] = nearest[crosses, 1]
            self._members[key] = self._upward(tree, nearest[:, 0], len(tree.sizes) - 1)
        return self._members[key]

    def parents(self, tree: TreeSettings, level: int) -> list[np.ndarray]:
        """(K,) int32 per level, the coarsest first: the centres that those of one level belong to, themselves last."""
        own = np.arange(len(self.levels(tree)[level].roots), dtype=np.int32)
        return self._upward(tree, own, level)

    def _upward(self, tree, places, level):
        """Places in a level and in all coarser ones, the coarsest first."""
        found = [places]
        levels = self.levels(tree)
        for finer in range(level, 0, -1):
            key = tree, finer
            if key not in self._parents:
                self._parents[key] = self._nearest(levels[finer], levels[finer - 1])[:, 0]
            found.insert(0, np.where(found[0] >= 0, self._parents[key][found[0]], -1))
        return found

    def _nearest(self, strands, centres):
        nearest = self.binder.nearest(strands, centres)
        require_indices("clump centres", nearest[:, 0] + 1, len(centres.roots) + 1)
        return nearest
