# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of styles that differ between strands, such as the radius of curls by a map.

A style computes the numbers of its steps from its settings. Settings that differ are arrays there, so each number has
one equation, and an array of equal values gives the bits of the value.

Where sizes of locks differ, each size has a clump tree of its own over the whole surface, and a strand belongs to locks
of the tree of its own size. So locks of one size are where they are in hair with this size everywhere. More than
`MOST_SIZES` sizes are replaced by as many sizes in equal ratios.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.mesh import SurfacePoints
from ..interpolation.hair_binding import HairBinding
from ..params import declared
from . import kinds, program
from .base import Cutter, Step, StyleSettings, TreeSettings, has_effect

MOST_SIZES = 8


@dataclass(frozen=True, eq=False)
class NumberMap:
    """Values of a setting of a style for strands.

    read: a function of roots (S,), IDs (S,) int32 and the clumps (S,) int32 of strands, None if unknown, that returns
    (S,) float64 in the setting's unit and range; is_of_places: whether values belong to places of the surface, so that
    the strands of a lock take that of the lock's center.
    """

    read: Callable[[SurfacePoints, np.ndarray, np.ndarray | None], np.ndarray]
    is_of_places: bool = True

    def of_strands(
        self, binding: HairBinding, clumps: np.ndarray | None, locks: tuple[HairBinding, np.ndarray] | None
    ) -> np.ndarray:
        """Return (S,) float64 of bound strands.

        clumps: (S,) int32, None if unknown; locks: binding of the centers that strands share numbers of, and (S,) the
        center of each strand, -1 for none; None for a step without locks.
        """
        own = self.read(binding.roots, binding.identities[0], clumps)
        if locks is None or not self.is_of_places or not len(locks[0].roots):
            return own
        of_centres, members = locks
        return np.where(members >= 0, self.read(of_centres.roots, of_centres.identities[0], None)[members], own)

    def of_guides(self, roots: SurfacePoints, identities: np.ndarray) -> np.ndarray:
        """Return (G,) float64 of guides with roots and IDs (G,) int32."""
        return self.read(roots, identities, None)


def places_of(steps: Sequence[Step], numbers: Mapping[tuple[int, str], NumberMap]) -> list[tuple[int, ...]]:
    """Return for each step the places of its numbers that differ between strands, rising."""
    found = []
    for step in steps:
        names = _names_of_style(step, numbers)
        ordered = _ordered(step, {name: np.array([getattr(step.settings, name)]) for name in names}, {})
        found.append(tuple(place for place, value in enumerate(ordered) if isinstance(value, np.ndarray)))
    return found


def rows_of(
    step: Step,
    numbers: Mapping[tuple[int, str], NumberMap],
    cutters: Mapping[str, Cutter],
    binding: HairBinding,
    clumps: np.ndarray | None,
    locks: tuple[HairBinding, np.ndarray] | None,
) -> list[np.ndarray]:
    """Return [(S,) float32] of the numbers of a step that differ between strands, in the order of `places_of`.

    Other arguments: as of `NumberMap.of_strands`; locks are used by steps whose module has `SHARED_BY_LOCKS`.
    """
    shared = locks if hasattr(kinds.STEPS[step.kind], "SHARED_BY_LOCKS") else None
    values = {
        name: numbers[step.place, name].of_strands(binding, clumps, shared) for name in _names_of_style(step, numbers)
    }
    return [row.astype(np.float32) for row in _ordered(step, values, cutters) if isinstance(row, np.ndarray)]


def _names_of_style(step, numbers):
    """Return the settings of a step's style that differ between strands."""
    return [name for place, name in numbers if place == step.place]


def _ordered(step, values, cutters):
    if not values:
        return []
    return program.numbers_of(kinds.steps_of(kinds.with_values(step.settings, values), cutters)[step.part])


@dataclass(frozen=True, eq=False)
class VariedTree:
    """The tree of a style whose size of locks differs between strands.

    number: the sizes of strands; sizes: (N,) [m] of the trees, rising; tree: with these trees as variants.
    """

    number: NumberMap
    sizes: np.ndarray
    tree: TreeSettings

    def choice(self, binding: HairBinding, clumps: np.ndarray | None) -> np.ndarray:
        """Return (S,) the variant of each strand: the nearest size by ratio; clumps: as of `NumberMap`."""
        return _nearest(self.number.read(binding.roots, binding.identities[0], clumps), self.sizes)


def varied_trees(
    styles: Sequence[StyleSettings], numbers: Mapping[tuple[int, str], NumberMap], binding: HairBinding
) -> dict[int, VariedTree]:
    """Return {index of the style: its `VariedTree`} of styles whose size of locks differs between bound strands."""
    found = {}
    for place, settings in enumerate(styles):
        base = program.tree_settings(settings) if has_effect(settings) else None
        name = next((name for its, name in numbers if its == place and _is_size(settings, name)), None)
        if base is None or name is None:
            continue
        number = numbers[place, name]
        sizes = _distinct(number.read(binding.roots, binding.identities[0], None))
        if not len(sizes):
            continue
        trees = (program.tree_settings(replace(settings, **{name: size})) for size in sizes.tolist())
        variants = tuple(tree for tree in trees if tree is not None)
        tree = variants[0] if len(variants) == 1 else replace(base, variants=variants)
        found[place] = VariedTree(number, sizes, tree)
    return found


def _is_size(settings, name):
    return any(its == name and details.is_structural for its, _default, details in declared(type(settings)))


def _distinct(values):
    """Return at most `MOST_SIZES` of (S,) values, rising."""
    found = np.unique(values)
    if len(found) <= MOST_SIZES:
        return found
    return np.geomspace(found[0], found[-1], MOST_SIZES)


def _nearest(values, sizes):
    """Return the indices (S,) of the sizes (N,) with the ratios to values (S,) nearest to one."""
    borders = np.sqrt(sizes[1:] * sizes[:-1])
    return np.searchsorted(borders, values)
