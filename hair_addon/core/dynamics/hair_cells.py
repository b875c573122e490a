# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells of a hair volume, and their effect on a point: functions for the kernels of hair_volume.py."""

import warp as wp

from ..kernels import native_code

# Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class Grid:
    """Cells of each region; corners are integral multiples of the cell size."""

    low: wp.vec3i
    counts: wp.vec3i
    per_cell: float  # [1/m]


@wp.func
def cell_of(grid: Grid, place: wp.vec3, region: int):
    """Return the index of the cell that contains a place [cells], -1 outside the grid."""
    x = int(wp.floor(place[0])) - grid.low[0]
    y = int(wp.floor(place[1])) - grid.low[1]
    z = int(wp.floor(place[2])) - grid.low[2]
    if wp.min(x, wp.min(y, z)) < 0:
        return -1
    if x + 1 >= grid.counts[0] or y + 1 >= grid.counts[1] or z + 1 >= grid.counts[2]:
        return -1
    return ((region * grid.counts[0] + x) * grid.counts[1] + y) * grid.counts[2] + z


@wp.func
def part_of(place: wp.vec3):
    """Return the fractional part of a place along each axis."""
    return wp.vec3(place[0] - wp.floor(place[0]), place[1] - wp.floor(place[1]), place[2] - wp.floor(place[2]))


@wp.func_native(native_code.body(__file__, "hair_motion.cpp"))
def _around(
    row: int,
    across: int,
    along: int,
    part: wp.vec3,
    wetness: float,
    fields: wp.array[wp.vec4],
    missing: wp.array[float],
) -> wp.spatial_vector: ...


@wp.func
def _bounded(change: wp.vec3, fastest: float):
    size = wp.length(change)
    if size > fastest:
        return change * (fastest / size)
    return change


@wp.func
def _settled(place: wp.vec3, then: wp.vec3, velocity: wp.vec3, per_step: float, change: wp.vec3, back: wp.vec3):
    """Limit the change of velocity of a point that would be pushed back in the next cell; places in cells.

    back: change of velocity at the next place, `then`. Between opposite pushes the point moves to the border of the
    cells, where it would otherwise oscillate forever.
    """
    for axis in range(3):
        here = wp.floor(place[axis])
        there = wp.floor(then[axis])
        if here != there and change[axis] * back[axis] < 0.0:
            wanted = (wp.max(here, there) - place[axis]) / per_step - velocity[axis]
            change[axis] = wp.clamp(wanted, wp.min(change[axis], back[axis]), wp.max(change[axis], back[axis]))
    return change


@wp.func
def rubbed(
    grid: Grid,
    region: int,
    place: wp.vec3,
    velocity: wp.vec3,
    wetness: float,
    fields: wp.array[wp.vec4],
    missing: wp.array[float],
    mixed: float,
    duration: float,
    pressure: float,
    fastest: float,
):
    """Return the velocity of a point at a place [cells] after friction, pressure and cohesion for a duration.

    fields, missing: as in `_around`; mixed: fraction of the velocity that is replaced by the mean; pressure: divided by
    the cell size, times the duration; fastest: largest change [m/s].
    """
    cell = cell_of(grid, place, region)
    if cell < 0:
        return velocity
    along = grid.counts[2]
    across = grid.counts[1] * along
    found = _around(cell, across, along, part_of(place), wetness, fields, missing)
    velocity = (1.0 - mixed) * velocity + mixed * wp.spatial_top(found)
    change = _bounded(pressure * wp.spatial_bottom(found), fastest)
    per_step = grid.per_cell * duration
    then = place + per_step * (velocity + change)
    cell = cell_of(grid, then, region)
    if wp.length_sq(change) > 0.0 and cell >= 0:
        found = _around(cell, across, along, part_of(then), wetness, fields, missing)
        back = _bounded(pressure * wp.spatial_bottom(found), fastest)
        change = _settled(place, then, velocity, per_step, change, back)
    return velocity + change
