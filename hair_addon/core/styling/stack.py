# SPDX-License-Identifier: GPL-3.0-or-later
"""A stack of styles on one hair: its program, clump trees and masks, and the order in which they are applied.

Center strands of clumps come first, level by level: each is styled by the steps above its own and by earlier levels.
Then one launch runs the whole program on all strands.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from .. import geometry, interpolation
from ..geometry.strands import Strands
from ..interpolation.hair_binding import HairBinding
from ..kernels import kernel_cache
from ..kernels.checks import require_count, require_indices
from . import kinds, steps, strand_wetness, varied_numbers
from . import program as programs
from .base import Step, StyleSettings, TreeSettings, has_effect
from .clump_trees import HAIR, ClumpTrees, Owner
from .guide_styles import FollowedGuides, leans
from .masks import Inputs
from .program import Program, mask_key
from .steps import StrandData

if TYPE_CHECKING:
    from ..interpolation.guide_weights import Reach

# No gradients are needed.
wp.set_module_options({"enable_backward": False})

_AGAINST = -0.5  # mean cosine between guides and normals below which hair grows on the surface's other side

# Points (N, P) [m] of a level's center strands without styles, for the present guides, and (N,) indices of these
# strands, None for all.
Centres = tuple["wp.array2d[wp.vec3]", np.ndarray | None]


@dataclass
class _Level:
    """Center strands of one level of a clump tree."""

    binding: HairBinding
    first: int  # index of its first center among all
    steps: Program  # applied to them
    data: StrandData

    @cached_property
    def reach(self) -> "Reach":
        """The centers that follow each guide."""
        return interpolation.guide_weights.reach(self.binding.guide_weights, len(self.binding.guide_positions))


@dataclass
class Styling:
    """Styles bound to the strands of one hair, from `stack.bind`."""

    binding: HairBinding
    side: int  # from `_side`
    guide_identities: np.ndarray  # (G,) int32
    styles: tuple[StyleSettings, ...]
    inputs: Inputs
    trees: ClumpTrees
    program: Program
    data: StrandData
    axes: np.ndarray  # (4, 4)
    followed: FollowedGuides
    point_count: int
    tree_levels: list[tuple[TreeSettings, int]]
    levels: list[_Level]

    def guides(self, guides: Strands) -> Strands:
        """Return the guides that strands follow: styled, with the strands' number of points."""
        return self.followed.of(guides)

    def apply(
        self, points: "wp.array2d[wp.vec3]", centres: "Sequence[Centres]", chosen: np.ndarray | None = None
    ) -> None:
        """Style strands in place: points (M, P) [m] of all strands, or of (M,) chosen ones.

        centres: `Centres` of each level; for chosen strands, only of the centers in `centres_of`.
        """
        if not len(self.program):
            return
        require_count("clump levels", len(centres), len(self.levels))
        for level, (its_points, rows) in zip(self.levels, centres, strict=True):
            its_rows = _on_device(rows, len(level.data.normals), points.device)
            steps.apply_steps(its_points, level.steps, level.data, self.axes, its_rows)
            self._keep_centres(its_points, np.arange(len(its_points)) if rows is None else rows, level.first)
        steps.apply_steps(
            points, self.program, self.data, self.axes, _on_device(chosen, len(self.data.normals), points.device)
        )

    def centres_of(self, chosen: np.ndarray) -> list[np.ndarray]:
        """Return for each level the indices of the centers that strands (M,) need, directly or through other centers.

        A center is styled like a strand, so it reads the centers of levels before its own. Raises `HairError` for
        indices that do not exist.
        """
        require_indices("strands", chosen, len(self.data.normals))
        members = self.data.members.numpy()[:, chosen]
        read = [_distinct(members[row]) for row in range(len(self.levels))]
        for row in range(len(self.levels) - 1, 0, -1):
            above = self.levels[row].data.members.numpy()[:row, read[row]]
            read[:row] = [_distinct(np.append(*pair)) for pair in zip(read[:row], above, strict=True)]
        return read

    @cached_property
    def used_centres(self) -> list[np.ndarray] | None:
        """`centres_of` all strands if sizes of locks differ between strands: most centers then have no strands.

        None if all centers are to be styled.
        """
        if not any(tree.variants for tree, _level in self.tree_levels):
            return None
        return self.centres_of(np.arange(len(self.data.normals)))

    def _keep_centres(self, centres, rows, first):
        """Write the points and arc lengths of a level's centers to the array that the kernel reads."""
        if not len(centres):
            return
        into = self.data.centre_points
        require_count("clump centers", len(rows), len(centres))
        require_indices("clump centers", rows + first, len(into))
        require_count("points of a centre strand", into.shape[1], centres.shape[1])
        rows = wp.array(rows + first, dtype=int, device=centres.device)
        kernel_cache.launch(_with_arcs, len(centres), inputs=[centres, rows], outputs=[into], device=centres.device)

    def reached(self, combed: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Return the ascending indices (M,) of the strands that move when guides are combed.

        combed: (C,) indices of guides; moved: indices of the strands that follow them. Strands whose clump centers
        follow them move too.
        """
        if not self.levels:
            return moved
        changed: list[np.ndarray] = []
        for level in self.levels:
            is_changed = np.zeros(len(level.binding.roots), bool)
            is_changed[level.reach.of(combed)] = True
            members = level.data.members.numpy()
            for row, centres in enumerate(changed):
                is_changed |= np.isin(members[row], centres)
            changed.append(np.flatnonzero(is_changed))
        is_moved = np.zeros(len(self.data.normals), bool)
        is_moved[moved] = True
        for members, centres in zip(self._members_of, changed, strict=True):
            is_moved[members.of(centres)] = True
        return np.flatnonzero(is_moved)

    @cached_property
    def _members_of(self):
        """The strands that belong to each center, for each level."""
        rows = self.data.members.numpy()[: len(self.levels)]
        return [
            interpolation.guide_weights.reach_by(members[:, None], len(level.binding.roots))
            for members, level in zip(rows, self.levels, strict=True)
        ]

    def clumps(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return (S,) int32 and (S,) float32 in [0, 1): the finest clump of each strand and the clump's random number.

        The clumps are those of the first style that gathers strands; None without such a style. -1 and 0 stand for
        strands without a clump.
        """
        if not self.tree_levels:
            return None
        row = len(self.tree_levels[0][0].sizes) - 1
        members = self.data.members.numpy()[row]
        numbers = self.levels[row].binding.identities[1][members]
        return members, np.where(members >= 0, numbers, np.float32(0.0))

    def lock_numbers(self) -> np.ndarray:
        """Return (S,) float32 random numbers in [0, 1) of the coarsest clumps of the first style that gathers strands.

        -1 for strands without a clump.
        """
        if not self.tree_levels:
            return np.full(len(self.data.identities.numpy()), np.float32(-1.0))
        members = self.data.members.numpy()[0]
        return np.where(members >= 0, self.levels[0].binding.identities[1][members], np.float32(-1.0))

    def wetness(self) -> np.ndarray | None:
        """Return (S,) float32 in [0, 1]: the wetness of each strand for the shading.

        None if neither a mask nor a variation makes it differ between strands.
        """
        if not strand_wetness.is_uneven(self.styles):
            return None
        keys = programs.mask_keys(self.styles)
        masks = dict(zip(keys, self.data.masks.numpy()[: len(keys)], strict=True))
        return strand_wetness.of_strands(self.styles, masks, self.data.identities.numpy())


def _on_device(rows, count, device):
    """Return indices of strands on a device, None for all. Raises `HairError` for indices that do not exist."""
    if rows is None:
        return None
    require_indices("strands", rows, count)
    return wp.array(rows, dtype=int, device=device)


def _distinct(members):
    """Return the distinct indices of members, without -1."""
    return np.unique(members[members >= 0])


@wp.kernel
def _with_arcs(
    points: wp.array2d[wp.vec3],
    rows: wp.array[int],
    # outputs
    out_points: wp.array2d[wp.vec4],
):
    strand = wp.tid()
    row = rows[strand]
    before = points[strand, 0]
    arc = float(0.0)
    for i in range(points.shape[1]):
        point = points[strand, i]
        arc += wp.length(point - before)
        out_points[row, i] = wp.vec4(point[0], point[1], point[2], arc)
        before = point


def bind(
    binding: HairBinding,
    guides: Strands,
    styles: Sequence[StyleSettings],
    inputs: Inputs,
    trees: ClumpTrees,
    axes: np.ndarray,
    point_count: int,
    varied: Mapping[int, varied_numbers.VariedTree] = MappingProxyType({}),
    former: Styling | None = None,
) -> Styling:
    """Bind styles to strands; sites that `trees` does not contain yet are placed and bound.

    binding and guides of the strands; inputs: `Inputs` of the styles; axes: (4, 4), from the coordinates of strands to
    the surface's own, without scale; point_count: points per strand; varied: from
    `varied_numbers.varied_trees`; former: a `Styling` of the same hair whose arrays are reused where they are equal.
    """
    levels = programs.tree_levels(styles, {place: found.tree for place, found in varied.items()})
    choosers = [varied.get(place) for place, style in enumerate(styles) for _level in _levels_of(style)]
    keys = programs.mask_keys(styles)
    bindings = [trees.levels(tree)[level] for tree, level in levels]
    first_centres = [0, *np.cumsum([len(bound.roots) for bound in bindings]).tolist()]
    made = programs.strand_steps(styles, inputs.cutters)
    numbers = varied_numbers.places_of(made, inputs.numbers)
    program = programs.compiled(made, keys, first_centres, numbers, inputs.courses)
    side = _side(guides, binding.guide_normals.numpy())
    own, of_levels, are_centres_same = _former_data(former, binding, bindings, side)
    known_centres = own if are_centres_same else None
    if former is not None and are_centres_same:
        identities = former.guide_identities
    else:
        identities = geometry.root_frames.identities(guides.roots, binding.is_mirrored)[0]
    centre_arrays = _centre_arrays(bindings, binding, identities, side, point_count, known_centres)
    reader = _StrandReader(inputs, trees, levels, choosers, bindings, made, numbers, keys, side, centre_arrays)
    centres = []
    for row, bound in enumerate(bindings):
        before = _steps_before(program, made, row)
        data = reader.data_of(levels[row], bound, row, len(before), of_levels[row])
        centres.append(_Level(bound, first_centres[row], before, data))
    if levels:
        used = {tree for tree, _level in levels}
        trees.keep_only(used.union(*(tree.variants for tree in used)))
    leaning = leans(
        styles,
        trees.binder.mesh,
        guides.roots,
        identities,
        {key: inputs.masks[key].of_guides(guides.roots) for key in keys},
        dict(inputs.targets),
        mask_key,
        inputs.numbers,
        inputs.courses,
    )
    return Styling(
        binding,
        side,
        identities,
        tuple(styles),
        inputs,
        trees,
        program,
        reader.data_of(HAIR, binding, len(levels), len(made), own),
        np.asarray(axes, np.float64),
        FollowedGuides(trees.binder.mesh, leaning, point_count),
        point_count,
        levels,
        centres,
    )


@dataclass(frozen=True)
class _StrandReader:
    """Reads the `StrandData` of hair and of the clump centers of its styles."""

    inputs: Inputs
    trees: ClumpTrees
    levels: list[tuple[TreeSettings, int]]
    choosers: list[varied_numbers.VariedTree | None]  # of each level
    bindings: list[HairBinding]  # of the centers of each level
    steps: list[Step]
    numbers: list[tuple[int, ...]]  # from `varied_numbers.places_of`
    mask_keys: list[tuple[str, str, bool]]
    side: int  # from `_side`
    centre_arrays: "dict[str, wp.array]"

    def data_of(
        self, owner: Owner, bound: HairBinding, known: int, step_count: int, former: StrandData | None
    ) -> StrandData:
        """Return the `StrandData` of strands that may belong to centers of the first `known` levels.

        step_count: number of first steps, which are applied to these strands; former: `StrandData` of the same strands
        for other settings, None: unknown.
        """
        device = self.centre_arrays["centre_normals"].device
        members = self._members_of(owner, bound, known)
        weights = self._weights_of(bound, members, _finest_clumps(self.levels, owner, members, known), step_count)
        if former is None:
            normals = bound.normals if self.side == 1 else _joined([self.side * bound.normals.numpy()], wp.vec3, device)
            identities = wp.array(bound.identities[0], dtype=int, device=device)
        else:
            normals, identities = former.normals, former.identities
        return StrandData(
            normals,
            identities,
            _kept(former and former.masks, former and former.masks_here, weights, float, device),
            _kept(former and former.members, former and former.members_here, members, int, device),
            **self.centre_arrays,
        )

    def _members_of(self, owner, bound, known):
        """Return (levels + 1, S) int32 centers of strands, and their nearest guides in the last row."""
        rows = np.zeros((len(self.levels) + 1, len(bound.roots)), np.int32)
        for row in range(known):
            tree, level = self.levels[row]
            if not isinstance(owner, str) and owner[0] == tree and level <= owner[1]:
                rows[row] = self.trees.parents(tree, owner[1])[level]
            else:
                clumps, chooser = _finest_clumps(self.levels, owner, rows, row), self.choosers[row]
                choice = None if chooser is None else chooser.choice(bound, clumps)
                rows[row] = self.trees.members(owner, bound, tree, choice)[level]
        rows[-1] = bound.guide_weights.indices.numpy()[:, 0]
        return rows

    def _weights_of(self, bound, members, clumps, step_count):
        """Return (masks, S) float32: weights of masks, and the numbers of steps that differ between strands."""
        values = [self.inputs.masks[key].of_strands(bound, clumps) for key in self.mask_keys]
        for step, places in zip(self.steps[:step_count], self.numbers, strict=False):
            if places:
                locks = None if step.level is None else (self.bindings[step.level], members[step.level])
                values += varied_numbers.rows_of(step, self.inputs.numbers, self.inputs.cutters, bound, clumps, locks)
        return np.array(values, np.float32).reshape(len(values), len(bound.roots))


def _former_data(former, binding, bindings, side):
    """Return (`StrandData` of the strands, [of the centers of each level], whether all centers are the same) of a
    former `Styling`; None where strands or centers differ.
    """
    if former is None or former.binding is not binding or former.side != side:
        return None, [None] * len(bindings), False
    known = {id(level.binding): level.data for level in former.levels}
    are_same = [id(level.binding) for level in former.levels] == list(map(id, bindings))
    return former.data, [known.get(id(bound)) for bound in bindings], are_same


def _kept(array, rows, values, kind, device):
    """Return a Warp array of values, the former one if its rows are equal; rows: None without a former array."""
    if rows is not None and np.array_equal(rows, values):
        return array
    return wp.array(values, dtype=kind, device=device)


def _centre_arrays(bindings, binding, guide_identities, side, point_count, former):
    """Return {field of `StrandData`: array} of the centers of all levels; the last are guides, without points.

    former: `StrandData` with the same centers, None: unknown. Points are never shared, as other threads may still style
    the former strands.
    """
    device = binding.positions.device
    count = sum(len(bound.roots) for bound in bindings)
    points = {"centre_points": wp.zeros((count, point_count), dtype=wp.vec4, device=device)}
    if former is not None:
        return points | {"centre_normals": former.centre_normals, "centre_identities": former.centre_identities}
    normals = [side * bound.normals.numpy() for bound in bindings]
    return points | {
        "centre_normals": _joined([*normals, side * binding.guide_normals.numpy()], wp.vec3, device),
        "centre_identities": _joined([*(bound.identities[0] for bound in bindings), guide_identities], int, device),
    }


def _levels_of(style):
    """Return the sizes of the levels of locks of a style."""
    tree = programs.tree_settings(style) if has_effect(style) else None
    return () if tree is None else tree.sizes


def _finest_clumps(levels, owner, rows, known):
    """Return (S,) int32: the clumps of strands as in `Styling.clumps`; None if the strands have no clumps or several.

    owner: as in `ClumpTrees.members`; rows: members of the first `known` levels.
    """
    if not levels:
        return None
    finest = len(levels[0][0].sizes) - 1
    if known > finest:
        return rows[finest]
    return np.arange(rows.shape[1], dtype=np.int32) if owner == levels[finest] else None


def _side(guides, normals):
    """Return -1 if hair grows against the surface's normals, as on meshes that are inside out; otherwise 1.

    Frames are rotated from the normal to a strand by the least rotation, which is undefined for opposite directions.
    """
    points = guides.numpy()
    segments = points[:, 1] - points[:, 0]
    lengths = np.maximum(np.linalg.norm(segments, axis=1), 1e-12)
    return -1 if ((segments * normals).sum(axis=1) / lengths).mean() < _AGAINST else 1


def _steps_before(program, made, level):
    """Return the steps above the one that gathers strands around the centers of a level."""
    rows = (row for row, step in enumerate(made) if step.level == level and kinds.needs_centre(step.kind))
    return program.before(next(rows))


def _joined(parts, kind, device):
    parts = [part if isinstance(part, np.ndarray) else part.numpy() for part in parts]
    return wp.array(np.concatenate(parts), dtype=kind, device=device)
