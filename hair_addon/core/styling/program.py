# SPDX-License-Identifier: GPL-3.0-or-later
"""Compilation of a stack of styles to a program for the kernel of steps.py, and the clump trees that it needs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from . import clump, courses, kinds, style_text, trim, wet
from .base import Cutter, Step, StyleSettings, TreeSettings, has_effect

if TYPE_CHECKING:
    from .steps import StrandData

# The whole numbers of a step: its kind, of `kinds.STEP_KINDS`; its seed; its row of masks or -1; its row of members or
# -1; the first of the centers that members count from; a bit for each number that differs between strands; the first of
# the rows after the masks that contain these numbers; the rows of its courses, from `courses.Table.packed`.
CHOICES = ("kind", "seed", "mask", "level", "first_centre", "varied", "first_varied", "courses")
# The numbers that all steps have, which precede their own numbers, and the total count.
SHARED = ("amount", "vary", "at_root", "at_tip", "exponent", "is_flipped", "from", "keep_length")
NUMBERS = 24

# The style that cuts strands to their length before all others, by a `masks.CutMask` with a key that no style has.
CUT = trim.Settings(factor=0.0)
CUT_KEY = ("", "", True)


@dataclass(frozen=True)
class Program:
    """Steps as read by kernels: (N, 8) int32 `CHOICES` and (N, NUMBERS) float32, which do not change.

    courses: (C, courses.SAMPLES) float32.
    """

    choices: np.ndarray
    numbers: np.ndarray
    courses: np.ndarray
    copies: dict[str, list[Any]] = field(init=False, default_factory=dict, compare=False)  # Warp arrays by device

    def __len__(self) -> int:
        return len(self.choices)

    def before(self, step: int) -> "Program":
        """Return the steps before a step."""
        return Program(self.choices[:step], self.numbers[:step], self.courses)


def tree_settings(settings: StyleSettings) -> TreeSettings | None:
    """Return the `TreeSettings` of a style that gathers strands; None for other styles."""
    module = kinds.module_of(settings)
    return module.tree(settings) if hasattr(module, "tree") else None


def tree_levels(
    styles: Sequence[StyleSettings], varied: Mapping[int, TreeSettings] = MappingProxyType({})
) -> list[tuple[TreeSettings, int]]:
    """Return [(tree, level)] of all styles that gather strands, in the order in which their centers are computed.

    varied: trees with variants, by the index of their style.
    """
    trees = [varied.get(place, tree_settings(style)) for place, style in enumerate(styles) if has_effect(style)]
    return [(tree, level) for tree in trees if tree is not None for level in range(len(tree.sizes))]


def mask_key(settings: StyleSettings) -> tuple[str, str, bool] | None:
    """Return the key of a style's mask, (name, image, whether it is inverted); None for a style without a mask."""
    if settings is CUT:
        return CUT_KEY
    if not settings.mask and not settings.mask_image:
        return None
    return settings.mask, settings.mask_image, settings.invert_mask


def mask_keys(styles: Sequence[StyleSettings]) -> list[tuple[str, str, bool]]:
    """Return the mask keys of styles that have an effect, each once."""
    found = (mask_key(settings) for settings in styles if has_effect(settings))
    return list(dict.fromkeys(key for key in found if key is not None))


def strand_steps(styles: Sequence[StyleSettings], cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps that act on strands, in order; cutters: planes by their names in Trim styles."""
    made: list[Step] = []
    level, coherent = 0, None
    for place, settings in enumerate(styles):
        if not has_effect(settings):
            continue
        tree = tree_settings(settings)
        made += [
            replace(step, level=coherent if step.level is None else level + step.level, place=place, part=part)
            for part, step in enumerate(kinds.steps_of(settings, cutters))
        ]
        if tree is not None:
            shared = settings.tip_level if isinstance(settings, clump.Settings) else 0
            coherent = level + min(shared, len(tree.sizes) - 1)
            level += len(tree.sizes)
    return made


def compiled(
    steps_made: Sequence[Step],
    masks: Sequence[tuple[str, str, bool]],
    first_centres: Sequence[int],
    varied: Sequence[Sequence[int]] = (),
    curves: courses.Courses = MappingProxyType({}),
) -> Program:
    """Return the `Program` of steps.

    masks: from `mask_keys`; first_centres: offset of the centers of each level, the guides' own last; varied: for each
    step the places of its numbers that differ between strands, from `varied_numbers.places_of`; none if it is empty;
    curves: courses of numbers. Raises `HairError` for too many courses.
    """
    choices = np.zeros((len(steps_made), len(CHOICES)), np.int32)
    numbers = np.zeros((len(steps_made), NUMBERS), np.float32)
    guides_level = len(first_centres) - 1
    first_varied = len(masks)
    table = courses.Table()
    for row, step in enumerate(steps_made):
        key = mask_key(step.settings)
        level = guides_level if step.level is None else step.level
        mask = -1 if key is None else masks.index(key)
        places = varied[row] if varied else ()
        bits = sum(1 << place for place in places)
        head = kinds.STEP_KINDS[step.kind], step.settings.seed, mask, level, first_centres[level]
        packed = table.packed(curves, step.place, courses.names_of(kinds.STEPS[step.kind]))
        choices[row] = *head, bits, first_varied, packed
        first_varied += len(places)
        row_numbers = numbers_of(step)
        numbers[row, : len(row_numbers)] = row_numbers
    return Program(choices, numbers, table.rows())


def numbers_of(step: Step) -> list[Any]:
    """Return a step's numbers, the `SHARED` ones first, in the order in which kernels read them; numbers that differ
    between strands are arrays.
    """
    profile = step.profile
    along = profile.root, profile.tip, profile.exponent, 1.0 * profile.is_flipped, profile.start
    return [step.amount, step.settings.vary, *along, step.keep_length, *style_text.ordered(step)]


def radius_factor(styles: Sequence[StyleSettings]) -> float:
    """Return the factor by which styles thicken strands: soaked strands swell."""
    swellings = [s.swelling * s.amount for s in styles if isinstance(s, wet.Settings) and has_effect(s)]
    return math.prod(1.0 + swelling for swelling in swellings)


def wetness(styles: Sequence[StyleSettings]) -> float:
    """Return the wetness for the shading: the largest of all styles."""
    return max((s.amount for s in styles if isinstance(s, wet.Settings) and has_effect(s)), default=0.0)


def same_steps(program: Program, data: "StrandData", other: Program, other_data: "StrandData") -> int:
    """Return the number of first steps that are equal in two programs, as are the data of strands that they read.

    Both programs are for the same strands and clump centers; only the members of centers may differ. A step may read
    points of clump centers, which are the same if all steps before it are the same.
    """
    count = min(len(program), len(other))
    choices, numbers = program.choices[:count], program.numbers[:count]
    is_same = (choices == other.choices[:count]).all(axis=1) & (numbers == other.numbers[:count]).all(axis=1)
    _kinds, _seeds, masks, levels, _centres, varied, first_varied, packed = choices.T
    if not np.array_equal(program.courses, other.courses):
        is_same &= packed == 0
    is_mask_same, is_member_same = data.are_rows_same(other_data)
    for step in np.flatnonzero(is_same).tolist():
        end = first_varied[step] + int(varied[step]).bit_count()
        are_same = is_mask_same[first_varied[step] : end].all() if varied[step] else True
        is_same[step] = (
            are_same
            and (masks[step] < 0 or is_mask_same[masks[step]])
            and (levels[step] < 0 or is_member_same[levels[step]])
        )
    return count if is_same.all() else int(np.argmin(is_same))
