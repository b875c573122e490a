# SPDX-License-Identifier: GPL-3.0-or-later
"""Sites of clumps in levels, and the strands that belong to each.

Sites are evenly spaced on the surface and are not roots of the hair, so a strand's clump depends only on its own root.
A strand belongs to the nearest site of the finest level, and a site to the nearest site of the next coarser level, so
locks consist of whole smaller locks. Strands and sites in a region without sites belong to none. Sites of the first
level may be the roots of chosen guides: a center there is the guide itself, without its neighbors.
"""

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
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

MOST_SITES = 20_000  # of the finest level: placing them takes one second; 50,000 on two levels take seven
MOST_SPARE = 2  # unused trees to keep: for a slider that goes back, or a style switched off and on
_HEXAGON = 0.866  # area of a site's cell divided by the square of the distance between sites

HAIR = "hair"  # owner of the hair's strands; centers have their tree and level as owner
Owner = str | tuple[TreeSettings, int]


def site_count(area: float, size: float) -> int:
    """Return the number of sites at a distance [m] from each other on an area [m²]."""
    return max(round(area / (_HEXAGON * size**2)), 1)


def size_factor(area: float, tree: TreeSettings) -> float:
    """Return the factor for the sizes of a tree on an area [m²] so that no level has more than `MOST_SITES`."""
    return max(math.sqrt(area / (_HEXAGON * MOST_SITES)) / min(tree.placed_sizes, default=math.inf), 1.0)


@dataclass
class ClumpTrees:
    """The clump trees of one hair, each computed once while its surface, guides' roots and density do not change.

    binder: binds sites to guides; place(count, seed, progress): `SurfacePoints` of evenly spaced sites; area: covered
    by hair [m²].
    """

    binder: RootBinder
    place: Callable[[int, int, Progress], SurfacePoints]
    area: float
    _levels: dict[TreeSettings, list[HairBinding]] = field(default_factory=dict)
    _members: dict[tuple[Owner, TreeSettings], list[np.ndarray]] = field(default_factory=dict)
    _parents: dict[tuple[TreeSettings, int], np.ndarray] = field(default_factory=dict)

    def levels(self, tree: TreeSettings, progress: Progress = no_progress) -> list[HairBinding]:
        """Return the centers of each level, the coarsest first, bound to guides.

        progress(step, part): called during placement; if it raises, no part of the tree is stored.
        """
        if tree not in self._levels and tree.variants:
            found = [self.levels(variant, progress) for variant in tree.variants]
            joined = [self._joined(levels) for levels in zip(*found, strict=True)]
            self._levels[tree] = joined if tree.guides is None else [*self._at_guides(tree), *joined[1:]]
        elif tree not in self._levels and (known := self._of_same_sites(tree)) is not None:
            self._levels[tree] = known
        elif tree not in self._levels:
            self._levels[tree] = [*self._at_guides(tree), *self._at_sites(tree, progress)]
        else:
            self._levels[tree] = self._levels.pop(tree)  # most recently used
        return self._levels[tree]

    def _at_guides(self, tree):
        """Return the binding of the first level of a tree at chosen guides; empty for other trees."""
        if tree.guides is None:
            return []
        chosen = np.array(tree.guides, np.int32)
        return [self.binder.bind_guides(np.tile(chosen, max(len(tree.variants), 1)))]

    def _at_sites(self, tree, progress):
        """Return the bindings of the levels of a tree whose sites are placed."""
        counts = self.site_counts(tree)
        ends = [0.0, *(sum(counts[: place + 1]) / sum(counts) for place in range(len(counts)))]
        first = len(tree.sizes) - len(counts)
        return [
            self.binder.bind(
                self.place(count, tree.seed + first + place, part_of(progress, ends[place], ends[place + 1]))
            )
            for place, count in enumerate(counts)
        ]

    def _of_same_sites(self, tree):
        """Return the known levels of a tree with the same sites and another crossover; None without such a tree."""
        alike = (known for known in self._levels if replace(known, crossover=tree.crossover) == tree)
        known = next(alike, None)
        return None if known is None else self._levels[known]

    def _joined(self, bindings):
        """Return the `HairBinding` of the centers of a level of several trees, one tree after the other."""
        roots = bindings[0].roots
        for binding in bindings[1:]:
            roots = roots.joined(binding.roots)
        return self.binder.bind(roots)

    def site_counts(self, tree: TreeSettings) -> list[int]:
        """Return the number of sites of each level whose sites are placed, the coarsest first."""
        factor = size_factor(self.area, tree)
        return [site_count(self.area, factor * size) for size in tree.placed_sizes]

    def search(self, trees: Collection[TreeSettings], progress: Progress = no_progress) -> None:
        """Compute the centers of trees that are missing; progress as in `levels`."""
        missing = self.lacks(trees)
        for place, tree in enumerate(missing):
            self.levels(tree, part_of(progress, place / len(missing), (place + 1) / len(missing)))

    def lacks(self, trees: Collection[TreeSettings]) -> list[TreeSettings]:
        """Return the trees that are not computed yet, each once."""
        return [tree for tree in dict.fromkeys(trees) if tree not in self._levels]

    def keep_only(self, used: Collection[TreeSettings]) -> None:
        """Remove unused trees except the last `MOST_SPARE`.

        Otherwise every value of a slider would leave a tree behind.
        """
        spare = [tree for tree in self._levels if tree not in used]
        for tree in spare[: max(len(spare) - MOST_SPARE, 0)]:
            del self._levels[tree]
        # Copies of these trees for other weights share this dictionary: removed entries are computed again.
        for owner, tree in list(self._members):
            named = {tree} if isinstance(owner, str) else {tree, owner[0]}
            if not named <= self._levels.keys():
                del self._members[owner, tree]
        for tree, level in list(self._parents):
            if tree not in self._levels:
                del self._parents[tree, level]

    def reweighed(self, settings: Any) -> "ClumpTrees":
        """Return the same trees for other weights, limits or lengths of `HairSettings`, without a search."""
        weighed = {
            tree: [interpolation.hair_binding.reweighed(binding, settings) for binding in levels]
            for tree, levels in self._levels.items()
        }
        return ClumpTrees(
            self.binder.with_settings(settings), self.place, self.area, weighed, self._members, self._parents
        )

    def members(
        self, owner: Owner, strands: HairBinding, tree: TreeSettings, choice: np.ndarray | None = None
    ) -> list[np.ndarray]:
        """Return (S,) int32 per level, the coarsest first: the index of each strand's center in its level, -1 for none.

        owner: key of the strands; choice: (S,) the variant of each strand, for a tree with variants.
        """
        if tree.variants:
            of_variants = [self.members(owner, strands, variant) for variant in tree.variants]
            return [
                self._chosen(tree, level, rows, choice) for level, rows in enumerate(zip(*of_variants, strict=True))
            ]
        key = owner, tree
        if key not in self._members:
            nearest = self._nearest(strands, self.levels(tree)[-1])
            if tree.crossover > 0.0:
                crosses = random_numbers(strands.identities[0], tree.seed, CROSSOVER) < tree.crossover
                crosses &= nearest[:, 1] >= 0
                nearest[crosses, 0] = nearest[crosses, 1]
            self._members[key] = self._upward(tree, nearest[:, 0], len(tree.sizes) - 1)
        return self._members[key]

    def _chosen(self, tree, level, rows, choice):
        """Return the centers (S,) of strands on a level of a tree with variants; rows: centers (S,) of each variant."""
        return np.choose(choice, self._shifted(tree, level, rows)).astype(np.int32)

    def _shifted(self, tree, level, rows):
        """Return the rows of centers of each variant, as indices among the centers of all variants on a level."""
        counts = [len(self.levels(variant)[level].roots) for variant in tree.variants]
        firsts = np.concatenate([[0], np.cumsum(counts[:-1])])
        return [np.where(row >= 0, row + first, -1) for row, first in zip(rows, firsts, strict=True)]

    def parents(self, tree: TreeSettings, level: int) -> list[np.ndarray]:
        """Return (K,) int32 per level, the coarsest first: the centers of coarser levels above the centers of a level.

        The last array is the indices of these K centers themselves.
        """
        own = np.arange(len(self.levels(tree)[level].roots), dtype=np.int32)
        return self._upward(tree, own, level)

    def _upward(self, tree, places, level):
        """Return indices in a level and in all coarser levels, the coarsest first."""
        found = [places]
        for finer in range(level, 0, -1):
            key = tree, finer
            if key not in self._parents:
                self._parents[key] = self._parents_of(tree, finer)
            found.insert(0, np.where(found[0] >= 0, self._parents[key][found[0]], -1))
        return found

    def _parents_of(self, tree, level):
        """Return (K,) int32 the center of each center of a level in the next coarser level."""
        if tree.variants:
            rows = [self._parents_of(variant, level) for variant in tree.variants]
            return np.concatenate(self._shifted(tree, level - 1, rows)).astype(np.int32)
        levels = self.levels(tree)
        return self._nearest(levels[level], levels[level - 1])[:, 0]

    def _nearest(self, strands, centres):
        nearest = self.binder.nearest(strands, centres)
        require_indices("clump centers", nearest[:, 0] + 1, len(centres.roots) + 1)
        return nearest
