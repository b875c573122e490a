# SPDX-License-Identifier: GPL-3.0-or-later
"""Applies styles to strands on the GPU, in the texture from which they are drawn, after strand_maker.py has made them.

The program of a stack is the same rows of numbers that core/styling runs: a slider only uploads these. Center strands
of clumps are made and styled first, level by level, in their own texture. The sources of steps are shared with
core/styling.

While a style's slider moves, strands are stored as they are before this style.
"""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import gpu
import numpy as np

from ....core.errors import HairError
from ....core.interpolation.hair_binding import HairBinding
from ....core.kernels.checks import require_count
from ....core.styling import kinds, style_text
from ....core.styling.program import CHOICES, NUMBERS, Program, same_steps
from ..programs import shaders, uniforms
from ..strand_textures import TEXTURE_WIDTH, StrandsOnGPU, row_strands_of, run_for_each
from . import strand_changes, strand_maker
from .strand_changes import StrandChanges
from .strand_maker import StrandMaker

if TYPE_CHECKING:
    from ....core.styling.stack import Styling
    from ....core.styling.steps import StrandData

MOST_POINTS = 128  # per strand: a thread needs 32 or 48 bytes per point

# Maximum number of strands that are made and styled together: they need 16 bytes per point, 43 MB with 41 points.
MOST_AT_ONCE = 1 << 16

# Maximum number of points that are kept between styles while a slider moves: 256 MiB.
MOST_KEPT = 1 << 24

_GROUP_SIZE = 32  # on an H200 styles take 1.2 ms for 65,000 strands, 1.7 ms with 64 and 2.4 ms with 128


def can_style(styling: "Styling") -> bool:
    """Whether the GPU can apply these styles; Warp applies other stacks."""
    program = styling.program
    is_short = len(program) <= uniforms.MOST_STEPS and len(program.courses) <= uniforms.MOST_COURSES
    return is_short and 2 <= styling.point_count <= MOST_POINTS


@dataclass
class _Pass:
    """Strands that are styled together: all of the hair, or the centers of one level of a clump tree."""

    known: gpu.types.GPUTexture  # for each strand its normal, identity, clump centers and masks
    record: np.ndarray  # uniforms.STYLING
    block: gpu.types.GPUUniformBuf

    def upload_masks(self, data: "StrandData") -> None:
        """Upload the data of strands again; must be followed by `upload_steps`."""
        self.known, self.record["row_known"], self.record["known_texels"] = _known(data)

    def upload_steps(self, program: Program) -> None:
        """Upload the rows of a program."""
        _put_steps(self.record, program)
        self.block.update(uniforms.bytes_of(self.record))


@dataclass
class StyleMaker:
    """Makes strands with styles; made by `new_style_maker`."""

    binding: HairBinding
    styling: "Styling"
    maker: StrandMaker
    centre_maker: StrandMaker | None  # None without clumps
    centres: gpu.types.GPUTexture | None  # (K, P) points of center strands, and arc lengths
    locks: gpu.types.GPUTexture  # for each clump center, and each guide, its normal and identity
    levels: list[_Pass]
    hair: _Pass
    changes: StrandChanges
    plain: list[gpu.types.GPUTexture]  # (`MOST_AT_ONCE`, P) strands before or between styles, for all parts or each
    _guide_points: np.ndarray | None = None  # of the last `make`
    # The styles of the last `make`, and the number of their first steps that were the same as before.
    _before: "Styling | None" = field(default=None, init=False)
    _same_before: int = field(default=0, init=False)
    _contained: int | None = field(default=None, init=False)  # number of steps applied in `plain`; None: unknown
    _lacks_memory: bool = field(default=False, init=False)  # whether the driver refused strands between styles

    @property
    def textures(self) -> list[gpu.types.GPUTexture]:
        """All textures."""
        own = [self.locks, *self.plain, self.hair.known, *(level.known for level in self.levels)]
        if self.centre_maker is not None:
            own += [self.centres, *self.centre_maker.textures]
        return own + self.maker.textures + self.changes.textures

    def make(
        self, strands: StrandsOnGPU, guide_points: np.ndarray, rest: gpu.types.GPUTexture | None = None
    ) -> StrandsOnGPU:
        """Make all strands with their styles, like `StrandMaker.make`, for guides from `Styling.guides`."""
        self.maker.require_fitting(strands)
        before, self._before = self._before, None  # in case drawing fails
        if self._guide_points is None or not np.array_equal(self._guide_points, guide_points):
            before = None
            self.maker.put_guides(guide_points)
            self._guide_points = guide_points.copy()
        if rest is None:
            self.changes.keep(strands)
        texture = strands.texture if rest is None else rest
        program = _styles_program(strands.point_count, _kinds_of(self.styling.program))
        are_centres_same, same = self._same_as(before)
        if self.centre_maker is not None and not are_centres_same:
            self.centre_maker.fill(self.centres)
            for level in self.levels:
                self._style(program, level, (self.centres, texture), 0, int(level.record["strand_count"]))
        self._make_hair(program, texture, strands.strand_count, same)
        self._before = self.styling
        return self.changes.changed(strands) if rest is None else strands

    def release_memory(self) -> None:
        """Release the memory for strands between styles, as no slider moves."""
        if len(self.plain) > 1:
            self.plain, self._contained = self.plain[:1], None
        self._same_before, self._lacks_memory = 0, False

    def _same_as(self, before):
        """Return (whether other styles have the same clump centers, the number of first steps with the same results).

        (False, None) if even strands without styles differ, or if another program is used, which may round differently.
        """
        if before is None or _kinds_of(before.program) != _kinds_of(self.styling.program):
            return False, None
        changed: list[int] = []  # levels with other centers
        for row, (level, known) in enumerate(zip(self.styling.levels, before.levels, strict=True)):
            same = _same_steps((level.steps, level.data), (known.steps, known.data), changed)
            if not same == len(level.steps) == len(known.steps):
                changed.append(row)
        now, then = ((styling.program, styling.data) for styling in (self.styling, before))
        return not changed, _same_steps(now, then, changed)

    def _make_hair(self, program, texture, strand_count, same):
        """Make strands without clump centers; same: the number of first steps with the same results as before."""
        step_count, contained = len(self.styling.program), self._contained
        self._contained = None  # in case drawing fails
        if same is None or (contained is not None and contained > same):
            contained = None
        firsts, first_step = range(0, strand_count, MOST_AT_ONCE), contained or 0
        kept = first_step
        if same is not None and same < step_count:
            if first_step < same == self._same_before and self._may_keep(strand_count):
                kept = same  # a slider moves
            self._same_before = same
        parts = self.plain if len(self.plain) > 1 else self.plain * len(firsts)
        for first, plain in zip(firsts, parts, strict=True):
            some = first, min(MOST_AT_ONCE, strand_count - first)
            if contained is None:
                self.maker.fill_some(plain, *some)
            if first_step < kept:
                self._style(program, self.hair, (plain, texture), *some, first_step, kept)
            self._style(program, self.hair, (plain, texture), *some, kept)
        self._contained = kept if len(self.plain) == len(firsts) else None

    def _may_keep(self, strand_count):
        """Whether each part of the strands has its own texture; creates missing textures if there is enough memory."""
        firsts, point_count = range(0, strand_count, MOST_AT_ONCE), self.styling.point_count
        if len(self.plain) < len(firsts):
            if self._lacks_memory or strand_count * point_count > MOST_KEPT:
                return False
            counts = [min(MOST_AT_ONCE, strand_count - first) for first in firsts]
            try:
                more = [strand_changes.empty_rows(count, point_count)[0] for count in counts[len(self.plain) :]]
            except HairError:  # hair can be made without this memory
                self._lacks_memory = True
                return False
            self.plain = [*self.plain, *more]
        return True

    def _style(self, program, strands, images, first, count, first_step=0, end_step=None):
        """Apply steps to some strands of a `_Pass`; if steps are left, strands are written to `plain` again."""
        plain, drawn = images
        end_step = int(strands.record["step_count"]) if end_step is None else end_step
        program.bind()
        program.uniform_block("styling", strands.block)
        program.uniform_sampler("known", strands.known)
        program.uniform_sampler("locks", self.locks)
        program.image("plain_strands", plain)
        program.image("centres", plain if self.centres is None else self.centres)
        program.image("strands", drawn)
        self.changes.bind(program)
        program.uniform_int("first_strand", first)
        program.uniform_int("some_count", count)
        program.uniform_int("first_step", first_step)
        program.uniform_int("end_step", end_step)
        run_for_each(program, count, _GROUP_SIZE)
        gpu.shader.unbind()

    def rebound(self, binding: HairBinding, styling: "Styling") -> "StyleMaker | None":
        """Return a maker with other weights or limits of the same strands and clumps; None if strands or clumps
        differ.

        Raises `HairError` like `new_style_maker`.
        """
        if not can_style(styling) or not _are_alike(styling, self.styling):
            return None
        maker, centre_maker = self.maker, self.centre_maker
        if binding.guide_weights is not self.binding.guide_weights:
            maker = maker.weighed(strand_maker.bound_strands(binding))
        maker = maker.limited(binding.limits.fading, binding.keep_length)
        if centre_maker is not None:
            centre_maker = centre_maker.weighed(_centres_of(styling)).limited(
                binding.limits.fading, binding.keep_length
            )
        for part, data, program in self._parts(styling):
            part.upload_masks(data)
            part.upload_steps(program)
        return replace(self, binding=binding, styling=styling, maker=maker, centre_maker=centre_maker)

    def _parts(self, styling):
        """Return [(pass, data of its strands, their program)]."""
        levels = [(own, level.data, level.steps) for own, level in zip(self.levels, styling.levels, strict=True)]
        return [(self.hair, styling.data, styling.program), *levels]

    def restyle(self, styling: "Styling") -> bool:
        """Use other settings of the same styles: only numbers and changed masks are uploaded.

        Returns False, without effect, if anything else has changed.
        """
        if styling is self.styling:
            return True
        is_alike = styling.trees is self.styling.trees and _are_alike(styling, self.styling)
        if not can_style(styling) or not is_alike:
            return False
        before = self._parts(self.styling)
        for (part, data, program), (_part, known, _program) in zip(self._parts(styling), before, strict=True):
            if not _have_same_rows(data, known):
                part.upload_masks(data)
            part.upload_steps(program)
        self.styling = styling
        return True


def programs_of(styling: "Styling | None", slot_count: int, point_count: int) -> list[tuple]:
    """Programs of `maker_of` and of the makers, for `shaders.compile_one`; slot_count: guides per strand."""
    if styling is None or not len(styling.program):
        return strand_maker.programs_of(slot_count, is_plain=False)
    plain = strand_maker.programs_of(slot_count, is_plain=True)
    return [*plain, (_styles_program, (point_count, _kinds_of(styling.program)))]


def maker_of(
    binding: HairBinding,
    styling: "Styling | None",
    point_count: int,
    axes: np.ndarray,
    before: StrandMaker | StyleMaker | None = None,
) -> StrandMaker | StyleMaker:
    """Return the maker of the strands of bound hair, with or without styles; the maker before, if it can be reused.

    before: for strands at the same places. point_count, axes: as for `new_maker`. Raises `HairError` like it.
    """
    if styling is None or not len(styling.program):  # styles of guides are applied to these already
        if isinstance(before, StrandMaker):
            return before
        return strand_maker.new_maker(strand_maker.bound_strands(binding), point_count, axes)
    if isinstance(before, StyleMaker) and before.binding is not binding:
        before = before.rebound(binding, styling)
    if isinstance(before, StyleMaker) and before.restyle(styling):
        return before
    require_count("points of a strand", point_count, styling.point_count)
    return new_style_maker(binding, styling, axes)


def new_style_maker(binding: HairBinding, styling: "Styling", axes: np.ndarray) -> StyleMaker:
    """Return the `StyleMaker` of bound hair and its styles, for which `can_style` must hold.

    axes: (3, 3), from the coordinates of roots and guides to those of drawn strands. Raises `HairError` like
    `new_maker`.
    """
    point_count = styling.point_count
    _styles_program(point_count, _kinds_of(styling.program))  # first: if it is not supported, nothing is uploaded
    maker = strand_maker.new_maker(strand_maker.bound_strands(binding), point_count, np.eye(3), is_plain=True)
    strand_count = len(styling.data.normals)
    changes = strand_changes.new_changes(strand_count, point_count)
    record = uniforms.STYLING.record()
    record["axes"] = styling.axes.T
    record["hand"] = np.sign(np.linalg.det(styling.axes[:3, :3]))
    record["row_packed"] = row_strands_of(point_count)
    record["level_count"] = len(styling.data.members)
    record["row_centres"] = TEXTURE_WIDTH // point_count
    locks, record["row_locks"] = _locks(styling.data)
    centre_maker, centres, levels = None, None, []
    if styling.levels:
        bound = _centres_of(styling)
        record["centre_count"] = len(bound.roots)
        centre_maker = strand_maker.new_maker(bound, point_count, np.eye(3), is_plain=True)
        centre_maker = replace(centre_maker, segments=maker.segments)
        centres, _in_row = strand_changes.empty_rows(len(bound.roots), point_count)
        for level in styling.levels:
            own = record.copy()
            own["first_strand"], own["are_centres"] = level.first, 1
            levels.append(_new_pass(own, level.data, level.steps, np.eye(3), point_count))
    hair = _new_pass(record, styling.data, styling.program, axes, point_count)
    plain, _in_row = strand_changes.empty_rows(min(strand_count, MOST_AT_ONCE), point_count)
    return StyleMaker(binding, styling, maker, centre_maker, centres, locks, levels, hair, changes, [plain])


def _new_pass(record, data, program, axes, point_count):
    known, record["row_known"], record["known_texels"] = _known(data)
    record["to_drawn"][:3, :3], record["to_drawn"][3, 3] = np.asarray(axes).T, 1.0
    record["strand_count"], record["point_count"] = len(data.normals), point_count
    record["row_strands"] = TEXTURE_WIDTH // point_count
    _put_steps(record, program)
    return _Pass(known, record, uniforms.own_uniform_buffer(record))


def _put_steps(record, program):
    rows = record["steps"][: len(program)]
    for column, name in enumerate(CHOICES):
        rows[name] = program.choices[:, column]
    rows["numbers"] = program.numbers.reshape(len(program), NUMBERS // 4, 4)
    record["step_count"] = len(program)
    record["courses"][: program.courses.size // 4] = program.courses.reshape(-1, 4)


def _kinds_of(program):
    """Return the kinds of a program's steps, for which the GPU program is compiled."""
    present = set(program.choices[:, 0].tolist())
    return tuple(name for name, kind in kinds.STEP_KINDS.items() if kind in present)


def _known(data: "StrandData"):
    """Return (texture, strands per row, texels per strand): see shaders/strands/style_strands.comp."""
    columns = [data.normals.numpy(), _halves(data.identities.numpy()), data.members_here.T, data.masks_here.T]
    rows = np.concatenate(columns, axis=1, dtype=np.float32)
    rows = np.pad(rows, ((0, 0), (0, -rows.shape[1] % 4)))
    texture, in_row = strand_changes.rows_texture(rows, 4)
    return texture, in_row, rows.shape[1] // 4


def _locks(data):
    """Return (texture, centers per row): normal and identity of each in two texels."""
    identities = _halves(data.centre_identities.numpy())
    rows = np.concatenate([data.centre_normals.numpy(), identities, np.zeros((len(identities), 3))], axis=1)
    return strand_changes.rows_texture(rows.astype(np.float32), 4)


def _halves(identities):
    """Return (N, 2): high and low 16 bits of (N,) int32, which are exact in single precision."""
    bits = identities.astype(np.int32).view(np.uint32)
    return np.stack([bits >> np.uint32(16), bits & np.uint32(0xFFFF)], axis=1)


def _centres_of(styling):
    """`BoundStrands` of the clump centers of all levels, level after level, which share their settings."""
    parts = [strand_maker.bound_strands(level.binding) for level in styling.levels]
    arrays = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("roots", "normals", "indices", "weights")
    }
    return replace(parts[0], **arrays)


def _are_alike(styling, other):
    """Whether two stacks on the same strands differ only in their numbers, masks and bindings of clumps."""
    return (
        styling.tree_levels == other.tree_levels
        and styling.point_count == other.point_count
        and np.array_equal(styling.axes, other.axes)
        and _are_equal(styling.data.normals, other.data.normals)
    )


def _are_equal(array, other):
    return array is other or np.array_equal(array.numpy(), other.numpy())


def _same_steps(now, before, changed):
    """`same_steps` for pairs (program, data), at most up to the first step that reads a level in `changed`."""
    same = same_steps(*now, *before)
    readers = np.flatnonzero(np.isin(now[0].choices[:same, CHOICES.index("level")], changed))
    return int(readers[0]) if len(readers) else same


def _have_same_rows(data, other):
    """Whether strands have the same masks and clump centers."""
    has_as_many = len(data.masks) == len(other.masks) and len(data.members) == len(other.members)
    return has_as_many and all(are_same.all() for are_same in data.are_rows_same(other))


@shaders.cached
def _styles_program(point_count, step_kinds):
    """Return the compute program that applies steps of some kinds to strands with `point_count` points."""
    info = gpu.types.GPUShaderCreateInfo()
    info.local_group_size(_GROUP_SIZE)
    info.typedef_source(uniforms.STEP.source + uniforms.STYLING.source)
    info.uniform_buf(0, "Styling", "styling")
    for slot, name in enumerate(("known", "locks")):
        info.sampler(slot, "FLOAT_2D", name)
    both = {"NO_RESTRICT", "READ", "WRITE"}  # centers are read from the image that other centers are written to
    for slot, name in enumerate(("plain_strands", "centres")):
        info.image(slot, "RGBA32F", "FLOAT_2D", name, qualifiers=both)
    strand_changes.declare_written(info, first_slot=2)
    for name in ("first_strand", "some_count", "first_step", "end_step"):
        info.push_constant("INT", name)
    constants = {"POINTS": point_count, **style_text.constants(), **{f"HAS_{name}": 1 for name in step_kinds}}
    for name, value in constants.items():
        info.define(name, str(value))
    return shaders.compile_compute(info, "strands/style_strands.comp", texts=style_text.texts(step_kinds))
