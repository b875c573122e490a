# SPDX-License-Identifier: GPL-3.0-or-later
"""The styles of bound hair: reading them from its Curves, and binding them to its strands."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from bpy.types import Curves, Depsgraph, Object

from ...core import grooming
from ...core.geometry.affine import Affine
from ...core.geometry.strands import Strands
from ...core.grooming.groom import HairSettings
from ...core.interpolation.hair_binding import HairBinding
from ...core.long_work import Progress, no_progress
from ...core.styling import program
from ...core.styling.base import StyleSettings, has_effect
from ...core.styling.clump_trees import ClumpTrees
from ...core.styling.masks import Inputs, Mask
from ..data import surface_space
from ..data.maps.sources import Source
from ..data.strands import style_inputs
from ..data.surfaces import Surface
from ..settings import setting_properties
from . import staleness, strand_lengths, varied_styles

if TYPE_CHECKING:
    from ...core.styling.stack import Styling


@dataclass(frozen=True)
class ReadStyles:
    """Styles of a hair system, and the inputs that they refer to.

    applied: from the local coordinates in which the hair was generated, which define the axes and the origin of random
    shapes, to the present ones; length: source of the map of the strands' length; map_status: sentence about a missing
    source of a map; numbers: the numbers of styles that maps or curves vary.
    """

    styles: tuple[StyleSettings, ...] = ()
    inputs: Inputs = field(default_factory=Inputs)
    applied: Affine = field(default_factory=Affine.identity)
    length: Source | None = None
    map_status: str = ""
    numbers: varied_styles.Numbers = field(default_factory=dict)

    def is_same(self, other: "ReadStyles") -> bool:
        """Whether both style hair identically."""
        if not np.array_equal(self.applied.matrix, other.applied.matrix) or not self.has_maps(
            other.length, other.map_status, other.numbers
        ):
            return False
        return self._active == other._active and _are_same(self.inputs, other.inputs)

    def has_maps(self, length: Source | None, map_status: str, numbers: varied_styles.Numbers) -> bool:
        """Whether the maps of `read_maps` vary strands."""
        is_same = length is None if self.length is None else self.length.is_same(length)
        return is_same and self.map_status == map_status and varied_styles.are_same(self.numbers, numbers)

    @cached_property
    def images_key(self) -> str:
        """`staleness.images_key` of the images that mask the styles."""
        values = {}
        for key in program.mask_keys(self.styles):
            mask = self.inputs.masks[key]
            if isinstance(mask, Mask) and mask.texture is not None:
                values[key[1]] = mask.texture.values
        return staleness.images_key(values)

    @property
    def _active(self):
        return [settings for settings in self.styles if has_effect(settings)]


@dataclass(frozen=True)
class StyledHair:
    """Styles bound to strands.

    styling: None if strands follow the guides unchanged; make_trees: a function that builds the hair's `ClumpTrees`.
    """

    read: ReadStyles
    styling: "Styling | None"
    make_trees: Callable[[], ClumpTrees]

    @property
    def radius_factor(self) -> np.float32:
        """Factor by which styles thicken strands."""
        return np.float32(program.radius_factor(self.read.styles))

    def continue_from(self, other: "StyledHair") -> None:
        """Reuse the guides that another `StyledHair` has computed, if the same styles lean them."""
        if self.styling is not None and other.styling is not None:
            self.styling.followed.continue_from(other.styling.followed)

    @property
    def clumps(self) -> tuple[np.ndarray, np.ndarray] | None:
        """(S,) int32 and (S,) float32: as `Styling.clumps`."""
        return None if self.styling is None else self.styling.clumps()

    @cached_property
    def wetness(self) -> np.ndarray | None:
        """(S,) float32: as `Styling.wetness`."""
        return None if self.styling is None else self.styling.wetness()

    @cached_property
    def trees(self) -> ClumpTrees:
        """Clump trees of the hair, built when a style needs them."""
        return self.make_trees() if self.styling is None else self.styling.trees

    def shared_trees(self) -> Callable[[], ClumpTrees]:
        """Return a function that gives other styles of the hair these `trees`, without a reference to this object."""
        if self.styling is None and "trees" not in vars(self):
            return self.make_trees
        trees = self.trees
        return lambda: trees


def read_styles(
    styles: Sequence[StyleSettings],
    surface_object: Object,
    surface: Surface,
    guide_curves: Curves | None,
    depsgraph: Depsgraph,
    hair: Curves | None = None,
) -> ReadStyles:
    """Return the `ReadStyles` of hair on a surface; guide_curves, hair: None if they are new. Raises `HairError`."""
    maps = read_maps(hair, surface_object, surface, styles)
    if not styles:
        return ReadStyles((), Inputs(), Affine.identity(), *maps)
    styles = [setting_properties.as_stored(settings) for settings in styles]  # rounded as Curves store them
    applied = Affine.identity() if hair is None else surface_space.applied(hair)
    inputs = style_inputs.read(surface_object, surface, guide_curves, styles, depsgraph)
    return ReadStyles(tuple(styles), inputs, applied, *maps)


def read_maps(
    hair: Curves | None, surface_object: Object | None, surface: Surface, styles: Sequence[StyleSettings]
) -> tuple[Source | None, str, varied_styles.Numbers]:
    """Return (length, map_status, numbers) of `ReadStyles`; hair: None if it is new."""
    length, status = strand_lengths.read(hair, surface_object, surface, styles)
    stored = [setting_properties.as_stored(settings) for settings in styles]
    numbers, other_status = varied_styles.read(hair, surface_object, surface, stored)
    return length, status or other_status, numbers


def bind(
    read: ReadStyles,
    binding: HairBinding,
    guides: Strands,
    settings: HairSettings,
    surface: Surface,
    make_trees: Callable[[], ClumpTrees],
    progress: Progress = no_progress,
    former: StyledHair | None = None,
) -> StyledHair:
    """Bind styles and lengths to strands.

    make_trees: called if one needs clump trees or a surface; former: `StyledHair` of the same hair, whose arrays are
    reused where they are equal.
    """
    cut = strand_lengths.cut_mask(read.length, settings)
    if cut is None and grooming.style_binding.is_plain(guides, settings, read.styles):
        return StyledHair(read, None, make_trees)
    styling = grooming.style_binding.bind_styles(
        binding,
        guides,
        settings,
        read.styles,
        make_trees(),
        replace(
            read.inputs,
            numbers=varied_styles.number_maps(read.numbers),
            courses=varied_styles.courses(read.numbers),
        ),
        grooming.style_binding.own_axes((Affine.linear(surface.to_world_axes) @ read.applied).matrix),
        progress,
        cut,
        None if former is None else former.styling,
    )
    return StyledHair(read, styling, make_trees)


def reweighed_trees(styles: StyledHair, settings: HairSettings) -> Callable[[], ClumpTrees]:
    """Return a function that builds a hair's clump trees for other weights, limits or lengths, without a search."""
    if styles.styling is None and "trees" not in vars(styles):
        # Skips settings in between: else a dragged slider would keep all of them in memory.
        known = styles.make_trees
        make = known.args[0] if isinstance(known, partial) and known.func is _weighed_trees else known
        return partial(_weighed_trees, make, settings)
    trees = styles.trees.reweighed(settings)
    return lambda: trees


def _weighed_trees(make_trees, settings):
    return make_trees().reweighed(settings)


def unstyled(
    styles: StyledHair, binding: HairBinding, guides: Strands, settings: HairSettings, surface: Surface
) -> StyledHair:
    """Return the `StyledHair` of the same strands without styles, with the same number of points."""
    return bind(ReadStyles(length=styles.read.length), binding, guides, settings, surface, styles.shared_trees())


def _are_same(inputs, others):
    if (inputs.masks.keys(), inputs.cutters.keys(), inputs.targets.keys(), inputs.guide_sets.keys()) != (
        others.masks.keys(),
        others.cutters.keys(),
        others.targets.keys(),
        others.guide_sets.keys(),
    ):
        return False
    pairs = []
    for key, mask in inputs.masks.items():
        other = others.masks[key]
        pairs += [(mask.corners, other.corners), (mask.guides, other.guides), (_values(mask), _values(other))]
    pairs += [(cutter.point, others.cutters[name].point) for name, cutter in inputs.cutters.items()]
    pairs += [(cutter.normal, others.cutters[name].normal) for name, cutter in inputs.cutters.items()]
    pairs += [(target, others.targets[name]) for name, target in inputs.targets.items()]
    pairs += [(are_chosen, others.guide_sets[name]) for name, are_chosen in inputs.guide_sets.items()]
    return all(_equal(*pair) for pair in pairs)


def _values(mask):
    return None if mask.texture is None else mask.texture.values


def _equal(one, other):
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)
