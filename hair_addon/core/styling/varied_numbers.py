# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of styles that differ between strands, such as the radius of curls by a map.

A style computes the numbers of its steps from its settings. Settings that differ are arrays there, so each number has
one equation, and an array of equal values gives the bits of the value.

Where sizes of locks differ, each size has a clump tree of its own over the whole surface, and a strand belongs to locks
of the tree of its own size. So locks of one size are where they are in hair with this size everywhere. More than
`MOST_SIZES` sizes are replaced by at most `MOST_SIZES` sizes in equal ratios. Other numbers of clump trees are treated
alike, with equal differences.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ..errors import HairError
from ..geometry.mesh import SurfacePoints
from ..interpolation.hair_binding import HairBinding
from ..kernels.checks import require_count
from ..params import declared
from . import kinds, program
from .base import Cutter, Step, StyleSettings, TreeSettings, guide_set, has_effect

MOST_SIZES = 8


@dataclass(frozen=True, eq=False)
class NumberMap:
    """Values of a setting of a style for strands.

    read: a function of roots (S,), IDs (S,) int32 and the clumps (S,) int32 of strands, None if unknown, that returns
    (S,) float64 in the setting's unit and range; is_of_places: whether values belong to places of the surface, so that
    the strands of a lock take the value at the lock's center.
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
class _Structural:
    """A number that changes a clump tree: its map, and the values (N,) that have trees, rising."""

    number: NumberMap
    values: np.ndarray
    is_length: bool

    def nearest(self, binding, clumps):
        """Return the index (S,) of the value nearest to that of each strand; lengths are compared by their ratio."""
        lower, upper = self.values[:-1], self.values[1:]
        borders = np.sqrt(lower * upper) if self.is_length else 0.5 * (lower + upper)
        return np.searchsorted(borders, self.number.read(binding.roots, binding.identities[0], clumps))


@dataclass(frozen=True, eq=False)
class VariedTree:
    """The tree of a style whose locks differ in size between strands, or have their centers at chosen guides.

    parts: the numbers that differ; tree: has a variant for each combination of their values, the last number fastest.
    """

    parts: tuple[_Structural, ...]
    tree: TreeSettings

    def choice(self, binding: HairBinding, clumps: np.ndarray | None) -> np.ndarray:
        """Return (S,) the variant of each strand; clumps: as of `NumberMap`."""
        found = np.zeros(len(binding.roots), int)
        for part in self.parts:
            found = found * len(part.values) + part.nearest(binding, clumps)
        return found


def varied_trees(
    styles: Sequence[StyleSettings],
    numbers: Mapping[tuple[int, str], NumberMap],
    binding: HairBinding,
    guide_sets: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> dict[int, VariedTree]:
    """Return {index of the style: its `VariedTree`} of styles whose locks differ in size between bound strands, or have
    their centers at chosen guides.

    guide_sets: as in `masks.Inputs`. Raises `HairError` for a missing or empty selection.
    """
    found = {}
    at_guides = trees_at_guides(styles, guide_sets, len(binding.guide_positions))
    for place, settings in enumerate(styles):
        base = program.tree_settings(settings) if has_effect(settings) else None
        known = [details for details in declared(type(settings)) if details[2].is_structural]
        varied = {name: numbers[place, name] for name, _default, _details in known if (place, name) in numbers}
        base = at_guides.get(place, base)
        if base is None or not (varied or place in at_guides) or not len(binding.roots):
            continue
        lengths = [details.unit == "LENGTH" for name, _default, details in known if name in varied]
        read = [number.read(binding.roots, binding.identities[0], None) for number in varied.values()]
        values = _values_of_trees(read, lengths, [getattr(settings, name) for name in varied])
        parts = tuple(map(_Structural, varied.values(), values, lengths))
        combinations = itertools.product(*(each.tolist() for each in values))
        changed = (replace(settings, **dict(zip(varied, chosen, strict=True))) for chosen in combinations)
        trees = (program.tree_settings(each) for each in changed)
        variants = tuple(replace(tree, guides=base.guides) for tree in trees if tree is not None)
        tree = variants[0] if len(variants) == 1 else replace(base, variants=variants)
        found[place] = VariedTree(parts, tree)
    return found


def trees_at_guides(
    styles: Sequence[StyleSettings], guide_sets: Mapping[str, np.ndarray], guide_count: int
) -> dict[int, TreeSettings]:
    """Return {index of the style: its tree} of styles whose centers are chosen guides.

    guide_sets: as in `masks.Inputs`. Raises `HairError` for a missing or empty selection.
    """
    found = {}
    for place, settings in enumerate(styles):
        tree, name = program.tree_settings(settings), guide_set(settings)
        if tree is not None and name is not None and has_effect(settings):
            found[place] = replace(tree, guides=_guides_of(name, guide_sets, guide_count))
    return found


def _guides_of(name, guide_sets, guide_count):
    """Return the rising indices of the guides of a selection, "" for all."""
    if name and name not in guide_sets:
        raise HairError('The guides have no selection "{name}" for the centers of locks: pick another.', name=name)
    are_chosen = guide_sets[name] if name else np.ones(guide_count, bool)
    require_count("guides", len(are_chosen), guide_count)
    if not are_chosen.any():
        raise HairError('The selection "{name}" for the centers of locks has no guides: pick another.', name=name)
    return tuple(np.flatnonzero(are_chosen).tolist())


def _values_of_trees(read, lengths, own):
    """Return the values of each number, rising, with at most `MOST_SIZES` combinations.

    read: [(S,)] of strands; own: values of the settings. Many values are replaced by steps from the setting, so that a
    painted map reuses the trees of its former values.
    """
    found = [np.unique(values) for values in read]
    if math.prod(map(len, found)) > MOST_SIZES:
        found = list(map(_steps, found, lengths, own))
    if math.prod(map(len, found)) <= MOST_SIZES:
        return found
    found = [np.unique(values) for values in read]
    most = max(int(MOST_SIZES ** (1.0 / len(found)) + 1e-9), 2)
    spaced = (np.geomspace if is_length else np.linspace for is_length in lengths)
    return [
        space(values[0], values[-1], most) if len(values) > most else values
        for space, values in zip(spaced, found, strict=True)
    ]


# Ratio of neighboring lengths; difference of other neighboring values.
_RATIO, _STEP = 10.0 ** (1.0 / (MOST_SIZES - 1)), 1.0 / MOST_SIZES


def _steps(values, is_length, own):
    """Return the steps from a setting's own value that are nearest to values (N,), rising."""
    if is_length:
        steps = own * _RATIO ** np.unique(np.rint(np.log(values / own) / np.log(_RATIO)))
        return np.minimum(steps, max(values[-1], own))  # within the range of the setting
    return np.clip(own + _STEP * np.unique(np.rint((values - own) / _STEP)), values[0], values[-1])
