# SPDX-License-Identifier: GPL-3.0-or-later
"""The kernel that applies a program of styles to strands: one launch for all steps.

steps.cpp and the files it includes are compiled for both kinds of device. A program is two arrays with a row per step:
whole numbers (`CHOICES`) and numbers (`NUMBERS`), as program.py writes them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import warp as wp

from ..errors import HairError
from ..kernels import native_code, parallel
from ..kernels.checks import require_count, require_indices
from . import courses, kinds, style_text
from .program import CHOICES, NUMBERS, Program

# No gradients are needed. A GPU's approximate divisions and roots move hair by less than 2e-6 of its size;
# steps.cpp uses exact operations where errors would be larger.
_OPTIONS = {"enable_backward": False, "fast_math": True}
wp.set_module_options(_OPTIONS)

LEAST_BLOCKS = 64  # fewer are not worth a thread
WIDTH = 16  # strands that a CPU thread styles at once; 8 at once take a fifth longer
MOST_POINTS = 257  # points of a strand
SHORT_POINTS = 64  # points of a strand in the variant with less GPU memory
POINTS_AT_ONCE = 5  # points of a strand in a GPU's shared memory: more take cache from directions and lengths


_TEXTS = style_text.texts(kinds.STEPS)
_CONSTANTS = style_text.constants() | {
    "CHOICES": len(CHOICES),
    "NUMBERS": NUMBERS,
    "POINTS_AT_ONCE": POINTS_AT_ONCE,
}


@dataclass(frozen=True)
class StrandData:
    """Inputs of a program for S strands, except their points: arrays on one device.

    The arrays of centers contain the K clump centers of all levels.
    """

    normals: "wp.array[wp.vec3]"  # (S,) unit
    identities: "wp.array[int]"  # (S,)
    masks: "wp.array2d[float]"  # (masks, S) weights, and numbers of steps that differ between strands
    members: "wp.array2d[int]"  # (levels, S) index of the strand's center in its level, -1: none
    centre_points: "wp.array2d[wp.vec4]"  # (K, P) x, y, z [m] and the arc length [m]
    centre_normals: "wp.array[wp.vec3]"  # (K,)
    centre_identities: "wp.array[int]"  # (K,)

    @cached_property
    def member_limits(self) -> tuple[np.ndarray, np.ndarray]:
        """(levels,) least (at most 0) and greatest member of each level, -1 if no strand has a center."""
        return self.members_here.min(axis=1, initial=0), self.members_here.max(axis=1, initial=-1)

    @cached_property
    def masks_here(self) -> np.ndarray:
        """`masks` on the CPU, copied once from a GPU."""
        return self.masks.numpy()

    @cached_property
    def members_here(self) -> np.ndarray:
        """`members` on the CPU, copied once from a GPU."""
        return self.members.numpy()

    def are_rows_same(self, other: "StrandData") -> tuple[np.ndarray, np.ndarray]:
        """Return for each row of `masks`, and of `members`, whether other data have the same row."""
        if self.masks is other.masks and self.members is other.members:
            return np.ones(len(self.masks), bool), np.ones(len(self.members), bool)
        return _are_same(self.masks_here, other.masks_here), _are_same(self.members_here, other.members_here)


def _are_same(rows, others):
    """Return for each row whether the other array has the same row."""
    found = np.zeros(len(rows), bool)
    if rows.shape[1:] != others.shape[1:]:
        return found
    for row in range(min(len(rows), len(others))):
        found[row] = np.array_equal(rows[row], others[row])
    return found


@dataclass(frozen=True)
class Variant:
    """The kernel for a number of strands that a CPU thread styles at once, and a maximum number of points."""

    kernel: wp.Kernel
    width: int
    most_points: int


def variant(width: int, most_points: int, module: wp.Module | None = None, has_courses: bool = False) -> Variant:
    """Return a `Variant` in a Warp module, by default the module of this file; has_courses: for programs with courses.

    With the code of courses, curls without courses would take 13 % more time, and frizz 10 %.
    """
    constants = _CONSTANTS | {"WIDTH": width, "MOST": most_points, "HAS_COURSES": int(has_courses)}
    if module is not None:
        module.options.update(_OPTIONS)

    @wp.func_native(native_code.body(__file__, "steps.cpp", _TEXTS, **constants))
    def _apply_steps(
        block: int,
        points: wp.array2d[wp.vec3],
        chosen_rows: wp.array[int],
        normals: wp.array[wp.vec3],
        identities: wp.array[int],
        masks: wp.array2d[float],
        members: wp.array2d[int],
        centre_points: wp.array2d[wp.vec4],
        centre_normals: wp.array[wp.vec3],
        centre_identities: wp.array[int],
        choices: wp.array2d[int],
        numbers: wp.array2d[float],
        courses: wp.array2d[float],
        axes: wp.mat44,
    ): ...

    # Blocks of 256 threads, three per multiprocessor: the number of registers is the limit.
    @wp.kernel(module=module, launch_bounds=(256, 3))
    def _style_blocks(
        points: wp.array2d[wp.vec3],
        chosen_rows: wp.array[int],
        normals: wp.array[wp.vec3],
        identities: wp.array[int],
        masks: wp.array2d[float],
        members: wp.array2d[int],
        centre_points: wp.array2d[wp.vec4],
        centre_normals: wp.array[wp.vec3],
        centre_identities: wp.array[int],
        choices: wp.array2d[int],
        numbers: wp.array2d[float],
        courses: wp.array2d[float],
        axes: wp.mat44,
        first: int,
    ):
        _apply_steps(
            first + wp.tid(),
            points,
            chosen_rows,
            normals,
            identities,
            masks,
            members,
            centre_points,
            centre_normals,
            centre_identities,
            choices,
            numbers,
            courses,
            axes,
        )

    return Variant(_style_blocks, width, most_points)


_ANY = variant(WIDTH, MOST_POINTS)
# A thread of a GPU reserves memory for the maximum number of points.
_SHORT = variant(WIDTH, SHORT_POINTS, wp.get_module(f"{__name__}_short"))
_WITH_COURSES = variant(WIDTH, MOST_POINTS, wp.get_module(f"{__name__}_courses"), has_courses=True)


def variant_for(point_count: int, device: wp.DeviceLike, has_courses: bool = False) -> Variant:
    """Return the `Variant` for a number of points on a device; has_courses: for programs with courses."""
    if has_courses:
        return _WITH_COURSES
    is_short = point_count <= SHORT_POINTS and not wp.get_device(device).is_cpu
    return _SHORT if is_short else _ANY


def apply_steps(
    points: wp.array2d[wp.vec3],
    program: Program,
    data: StrandData,
    axes: np.ndarray,
    chosen: wp.array[int] | None = None,
    version: Variant | None = None,
) -> None:
    """Style strands in place: points (M, P) [m]. One launch for the whole program; none for an empty one.

    data: `StrandData` of S strands, of which chosen (M,) int32 are styled, all if None; axes: (4, 4), from the
    coordinates of points to the surface's own, without scale; version: of the kernel, None for the fastest that applies
    the program's courses. Raises `HairError` if counts or indices do not match.
    """
    if not len(program) or not len(points):
        return
    device = points.device
    version = variant_for(points.shape[1], device, len(program.courses) > 0) if version is None else version
    _check(points, program, data, chosen, version.most_points)
    rows = wp.empty(0, dtype=int, device=device) if chosen is None else chosen
    lanes = version.width if device.is_cpu else 1
    block_count = -(-len(points) // lanes)
    inputs = [points, rows, data.normals, data.identities, data.masks, data.members]
    inputs += [
        data.centre_points,
        data.centre_normals,
        data.centre_identities,
        *_copied(program, device),
        wp.mat44(axes),
    ]
    share_count = parallel.share_count(block_count, device, LEAST_BLOCKS)
    parallel.launch_shares(version.kernel, block_count, inputs, [[] for _ in range(share_count)], device)


def _copied(program, device):
    """Return the arrays of a program on a device, copied once, because a stroke launches it repeatedly."""
    if device.alias not in program.copies:
        choices = wp.array(program.choices, dtype=int, device=device)
        tables = [wp.array(rows, dtype=float, device=device) for rows in (program.numbers, program.courses)]
        program.copies[device.alias] = [choices, *tables]
    return program.copies[device.alias]


def _check(points, program, data, chosen, most_points):
    """Raise `HairError` unless everything that the kernel reads exists."""
    point_count, strand_count, centre_count = points.shape[1], len(data.normals), len(data.centre_normals)
    if not 2 <= point_count <= most_points:
        raise HairError(f"Strands need 2 to {most_points} points to be styled, not {point_count}.")
    require_count("strands", len(points), strand_count if chosen is None else len(chosen))
    require_count("identities", len(data.identities), strand_count)
    require_count("clump identities", len(data.centre_identities), centre_count)
    for name, array in (("masks", data.masks), ("clump members", data.members)):
        if len(array):
            require_count(name, array.shape[1], strand_count)
    require_count("choices of a step", program.choices.shape[1], len(CHOICES))
    require_count("numbers of a step", program.numbers.shape[1], NUMBERS)
    require_count("steps", len(program.numbers), len(program))
    require_count("samples of a course", program.courses.shape[1], courses.SAMPLES)
    step_kinds, _seeds, masks, levels, first_centres, varied, first_varied, packed = program.choices.T
    for slot in range(courses.MOST_OF_A_STEP):
        rows = ((packed >> (courses.BITS * slot)) & ((1 << courses.BITS) - 1)) - 1
        require_indices("courses", rows[rows >= 0], len(program.courses))
    has_varied = varied != 0
    require_indices("first numbers of strands", first_varied[has_varied], len(data.masks))
    ends = first_varied + np.bitwise_count(varied)
    require_indices("numbers of strands", ends[has_varied] - 1, len(data.masks))
    require_indices("kinds of steps", step_kinds - 1, len(kinds.STEPS))
    require_indices("masks", masks[masks >= 0], len(data.masks))
    require_indices("clump levels", levels[levels >= 0], len(data.members))
    least, greatest = data.member_limits
    require_indices("clump members", least + 1, centre_count + 1)
    last_centres = first_centres + np.maximum(greatest[levels], 0) if len(data.members) else first_centres
    has_centres = levels >= 0
    has_centres[has_centres] = greatest[levels[has_centres]] >= 0
    require_indices("clump centers", last_centres[has_centres], centre_count)
    needs_points = (_CONSTANTS["NEEDING_CENTRE"] >> step_kinds) & 1 == 1
    require_indices("clump levels", levels[needs_points], len(data.members))
    if needs_points.any():
        # The last centers may be guides, which have no points here.
        require_indices("clump centers", last_centres[needs_points], min(len(data.centre_points), centre_count))
        require_count("points of a centre strand", data.centre_points.shape[1], point_count)
