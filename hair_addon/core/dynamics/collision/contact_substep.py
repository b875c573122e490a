# SPDX-License-Identifier: GPL-3.0-or-later
"""Substeps of strands with collisions: the stages of the solver, with contact queries between them.

On a CPU one kernel runs all stages for a group of strands, whose state stays in the cache. A separate pass over all
strands for each stage took twice as long in a test without contacts. On a GPU each stage is a launch; the launches of a
frame are recorded once and replayed, because launching from Python would take longer than the kernels.
"""

from dataclasses import replace
from typing import Any

import warp as wp

from ...kernels import parallel
from ...kernels.replays import Replays
from ..rod import rod_solver
from ..rod.rod_solver import (
    AGAIN,
    FINISH,
    PREDICT,
    SOLVE,
    Around,
    FrameSubsteps,
    Numbers,
    RodArrays,
    Surroundings,
    advance_block,
)
from ..rod.rods import Rods
from .contact import Contacts, query_options
from .contact_queries import WIDTH, QueryOptions, Samples, any_moved, find_in, query_of
from .nearest_surface import Surface

# No gradients are needed. The solver fuses multiply-adds explicitly (`fused` of lanes.h).
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_ROUNDS = 4
_PREDICT, _SOLVE = wp.constant(PREDICT), wp.constant(SOLVE)
_FINISH, _AGAIN = wp.constant(FINISH), wp.constant(AGAIN)
_WIDTH = wp.constant(WIDTH)


class CollidingStrands:
    """Strands with their contacts, and memory for the planes of the groups in progress."""

    takes_groups = True  # on a CPU: True runs all stages group by group, False runs stage by stage, as on a GPU

    def __init__(self, rods: Rods, contacts: Contacts) -> None:
        self._rods, self._contacts = rods, contacts
        self._replays = Replays(rods.device)
        self._planes: list[tuple[Any, Any, Any]] = []  # planes of each share of the strands

    def advance(self, step: FrameSubsteps, first: int, end: int, surroundings: Surroundings) -> None:
        """Advance by substeps first … end - 1, and pose the colliders. Raises `HairError` if counts do not match."""
        colliders = self._contacts.colliders
        self._contacts.expect(step.count)
        if not (self._rods.device.is_cpu and self.takes_groups):
            self._advance_stages(step, first, end, surroundings)
        elif colliders.is_still:
            self._advance_groups(step, first, end, surroundings)
        else:
            for substep in range(first, end):
                colliders.pose((substep + 1) / step.count)
                self._advance_groups(step, substep, substep + 1, surroundings)

    def _advance_stages(self, step, first, end, surroundings):
        """Run the stages as recorded launches; data that changes between frames is in arrays."""
        rods, contacts, colliders = self._rods, self._contacts, self._contacts.colliders
        contacts.follow()
        for substep in range(first, end):
            colliders.go_to((substep + 1) / step.count)
            contacts.follow()
            contacts.note_motion(substep)
        contacts.send_motions(first, end)
        step = rods.begun(step)
        around = (surroundings.airs, surroundings.drags, surroundings.accelerations)
        memory = contacts.memory() + [None if array is None else array.ptr for array in around]
        key = colliders.build_count, colliders.is_still, colliders.largest_distance, *memory
        # The first substep after a change of the substeps' duration differs from the others.
        middle = end if step.carried == 1.0 else first + 1
        self._replay(key, step, first, middle, surroundings)
        if middle < end:
            self._replay(key, replace(step, carried=1.0), middle, end, surroundings)
        rods.step_size = step.size

    def _replay(self, key, step, first, end, surroundings):
        self._replays.run((*key, step, first, end), lambda: self._launch_stages(step, first, end, surroundings))

    def _launch_stages(self, step, first, end, surroundings):
        rods, contacts = self._rods, self._contacts
        planes, found, _middle_planes = contacts.planes
        places = rods.arrays.positions, rods.arrays.positions_before
        asking, final, again = _options_of_queries(step)
        with_planes, with_found = Surroundings(planes), Surroundings(planes, found)
        for substep in range(first, end):
            contacts.colliders.place((substep + 1) / step.count)
            surface, part = contacts.surface(substep), (substep, substep + 1)
            rod_solver.advance(rods.arrays, step, rods.scratch, *part, PREDICT, surroundings)
            contacts.look(surface, asking, *places)
            rod_solver.advance(rods.arrays, step, rods.scratch, *part, SOLVE, with_planes)
            contacts.look(surface, final, *places)
            rod_solver.advance(rods.arrays, step, rods.scratch, *part, AGAIN, with_found)
            contacts.look(surface, again, *places, rods.arrays.solved_again)
            rod_solver.advance(rods.arrays, step, rods.scratch, *part, FINISH, with_found)
            step = replace(step, carried=1.0)

    def _advance_groups(self, step, first, end, surroundings):
        """Run all stages group by group."""
        rods, contacts = self._rods, self._contacts
        contacts.follow()
        contacts.note_motion()
        contacts.send_motions()
        step = rods.begun(step)
        numbers, _ = rod_solver.kernel_inputs(rods.arrays, step, rods.scratch, first, end, surroundings)
        stages = rod_solver.stages_of(rods.arrays, step, PREDICT | SOLVE | AGAIN | FINISH)
        asking = _options_of_queries(step)
        inputs = [stages, _ROUNDS, numbers, rods.arrays, rods.scratch, contacts.surface(), *asking]
        inputs += [contacts.vertices, contacts.middles]
        group_count = len(rods.arrays.positions)
        share_count = parallel.share_count(group_count, rods.device, rod_solver.LEAST_GROUPS)
        outputs = []
        for planes in self._planes_of(share_count):
            around = rod_solver.around_of(surroundings)
            around.planes, around.found_planes, middle_planes = (_for_each(array, group_count) for array in planes)
            outputs.append([around, middle_planes])
        parallel.launch_shares(_advance_groups, group_count, inputs, outputs, rods.device)
        rods.step_size = step.size

    def _planes_of(self, share_count):
        """Return the planes of one group for each share; the groups of a share use this memory in turn."""
        while len(self._planes) < share_count:
            self._planes.append(self._contacts.planes_of(1))
        return self._planes[:share_count]


def _options_of_queries(step):
    """Return the `QueryOptions` before the solve, after the solve, and after AGAIN."""
    return query_options(step.size), query_options(0.0, is_final=True), query_options(0.0, is_final=True, is_again=True)


def _for_each(array, group_count):
    """Return a view of one group's memory as an array of many groups; the groups use the memory in turn."""
    _, rows, lanes = array.shape
    shape, strides = (group_count, rows, lanes), (0, *array.strides[1:])
    return wp.array(ptr=array.ptr, dtype=float, shape=shape, strides=strides, device=array.device)


@wp.kernel
def _advance_groups(
    stages: int,
    round_count: int,
    step: Numbers,
    strands: RodArrays,
    scratches: wp.array3d[float],
    surface: Surface,
    first_asking: QueryOptions,
    final_asking: QueryOptions,
    again_asking: QueryOptions,
    vertices: Samples,
    middles: Samples,
    first: int,
    # outputs
    around: Around,
    middle_planes: wp.array3d[float],
):
    """round_count: `_ROUNDS`, unknown to the compiler, so that the loop is not unrolled around the solver."""
    group = first + wp.tid()
    is_near = int(0)
    for index in range(round_count * (step.end - step.first)):
        part = index % round_count
        substep = step.first + index // round_count
        stage = _PREDICT
        is_needed = int(1)
        if part == 1:
            stage = _SOLVE
            find_group(surface, first_asking, strands, middle_planes, 1, group, middles, middle_planes)
            find_group(surface, first_asking, strands, middle_planes, 0, group, vertices, around.planes)
        elif part == 2:
            stage = _AGAIN
            is_needed = find_group(
                surface, final_asking, strands, middle_planes, 0, group, vertices, around.found_planes
            )
            is_near = is_needed
        elif part == 3:
            stage = _FINISH
            if is_near != 0 and any_moved(strands.solved_again, group, 0, _WIDTH) != 0:
                find_group(surface, again_asking, strands, middle_planes, 0, group, vertices, around.found_planes)
        if is_needed != 0:
            advance_block(group, stages & stage, substep, substep + 1, step, strands, around, scratches)


@wp.func
def find_group(
    surface: Surface,
    asking: QueryOptions,
    strands: RodArrays,
    middle_planes: wp.array3d[float],
    is_middle: int,
    group: int,
    samples: Samples,
    planes: wp.array3d[float],
) -> int:
    before = strands.positions_before
    query = query_of(surface, asking, strands.positions, before, middle_planes, is_middle, samples, planes)
    return find_in(query, group, 0, samples.rest.shape[1], 0, _WIDTH)
