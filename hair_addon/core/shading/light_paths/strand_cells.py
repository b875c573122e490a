# SPDX-License-Identifier: GPL-3.0-or-later
"""The segments of strands in each cell: voxels with hair are divided into cells, other voxels are empty.

Paths wait longer for memory than for arithmetic. Each cell therefore stores the lines of its segments consecutively, in
eight bytes each, by which most segments are rejected without reading their points.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import kernel_cache, parallel, running_sums
from ...kernels.checks import require_count

wp.set_module_options({"enable_backward": False, "fast_math": True})

_LEAST_SEGMENTS = 20_000  # fewer are not worth a thread
_WIDER = wp.constant(1e-4)  # enlargement of segments for rounding, relative to a cell
_REACH = wp.constant(1.7321)  # greatest distance in cells from a cell's center to the nearest point of a line
_STEPS = wp.constant(1023.0)  # steps of this point's place, along each axis
LINE_CENTRE = wp.constant(511.5)  # half of these steps
_TURNS = wp.constant(65535.0)  # steps of a line's direction, along both axes
LINE_ERROR = wp.constant(0.004)  # maximum distance in cells between a line and its stored form
_COUNT, _WRITE, _COUNT_BY_CELL, _PUT = (wp.constant(step) for step in range(4))  # steps of `_find`
_WIDTHS = wp.constant(4)  # number of stored radii, each half the previous one


@dataclass(frozen=True, eq=False)
class StrandCells:
    """Segments in the cells of V voxels, of which B are divided into K³ cells."""

    along_voxel: int  # K
    radius: float  # the largest [m]
    bricks: wp.array[int]  # (V,): index of each voxel among the divided voxels, -1 for empty voxels
    starts: wp.array[int]  # (B K³ + 1,): first entry of each cell in `segments`
    segments: wp.array[int]  # (M,) first points of segments, once for each of their cells, ascending in each cell
    lines: wp.array[wp.uint32]  # (2 M,) two words of `line_of` for each of `segments`

    @property
    def widths(self) -> np.ndarray:
        """(4,) radii [m] to which the radii of segments are rounded up: the largest, and each half the previous one."""
        return self.radius * 0.5 ** np.arange(_WIDTHS)


@wp.struct
class _Strands:
    """Strands, and the voxels around them, which are divided into cells."""

    points: wp.array[wp.vec3]
    radii: wp.array[float]
    strands: wp.array[int]
    radius: float
    corner: wp.vec3
    voxel: float
    shape: wp.vec3i
    along_voxel: int


@wp.struct
class _Axis:
    """A segment's axis, from `origin` to `origin` + `way`.

    Parts of it are given as fractions (first, last) of `way`.
    """

    origin: wp.vec3
    way: wp.vec3
    inverse: wp.vec3  # component-wise reciprocal of `way`
    radius: float


@wp.func
def _axis_of(hair: _Strands, segment: int, side: float):
    """Return the axis of a segment; side: of the cells [m]."""
    axis = _Axis()
    axis.origin = hair.points[segment]
    axis.way = hair.points[segment + 1] - axis.origin
    axis.radius = wp.max(hair.radii[segment], hair.radii[segment + 1]) + _WIDER * side
    for along in range(3):
        # A zero-length component is wholly inside or wholly outside of a cell.
        length = axis.way[along]
        if wp.abs(length) < 1e-20:
            length = 1e-20
        axis.inverse[along] = 1.0 / length
    return axis


@wp.func
def _cells_along(hair: _Strands, axis: _Axis, along: int, first: float, last: float, per_side: float):
    """Return the (first, last) cells along X, Y or Z that a part of a segment touches with its width."""
    a = axis.origin[along] + first * axis.way[along] - hair.corner[along]
    b = axis.origin[along] + last * axis.way[along] - hair.corner[along]
    most = float(hair.shape[along] * hair.along_voxel - 1)
    low = wp.clamp((wp.min(a, b) - axis.radius) * per_side, 0.0, most)
    high = wp.clamp((wp.max(a, b) + axis.radius) * per_side, 0.0, most)
    return int(low), int(high)


@wp.func
def _part_in_layer(hair: _Strands, axis: _Axis, along: int, cell: int, first: float, last: float, side: float):
    """Return the fractions (first, last) of a segment within one layer of cells.

    First > last if it misses the layer.
    """
    low = hair.corner[along] + side * float(cell) - axis.origin[along]
    one = (low - axis.radius) * axis.inverse[along]
    other = (low + side + axis.radius) * axis.inverse[along]
    return wp.max(first, wp.min(one, other)), wp.min(last, wp.max(one, other))


@wp.func
def _place_word(origin: wp.vec3, way: wp.vec3, centre: wp.vec3, side: float, halvings: int):
    part = wp.dot(centre - origin, way) / wp.max(wp.dot(way, way), 1e-30)
    nearest = (origin + part * way - centre) / (2.0 * _REACH * side) + wp.vec3(0.5, 0.5, 0.5)
    where = wp.uint32(halvings) << wp.uint32(30)
    for axis in range(3):
        step = wp.clamp(int(nearest[axis] * _STEPS + 0.5), 0, int(_STEPS))
        where = where | (wp.uint32(step) << wp.uint32(10 * axis))
    return where


@wp.func
def _direction_word(way: wp.vec3):
    flat = way / wp.max(wp.abs(way[0]) + wp.abs(way[1]) + wp.abs(way[2]), 1e-30)
    x = flat[0]
    y = flat[1]
    if flat[2] < 0.0:
        x = (1.0 - wp.abs(flat[1])) * wp.where(flat[0] < 0.0, -1.0, 1.0)
        y = (1.0 - wp.abs(flat[0])) * wp.where(flat[1] < 0.0, -1.0, 1.0)
    return wp.uint32((0.5 + 0.5 * x) * _TURNS + 0.5) | (wp.uint32((0.5 + 0.5 * y) * _TURNS + 0.5) << wp.uint32(16))


@wp.func
def line_of(origin: wp.vec3, way: wp.vec3, centre: wp.vec3, side: float, halvings: int):
    """Return two words that store a line: its point nearest to a cell's center, ten bits per axis; `halvings` of the
    largest radius to the segment's; and its direction on an octahedron [Meyer10], 16 bits per axis.
    """
    return _place_word(origin, way, centre, side, halvings), _direction_word(way)


@wp.func
def line_step(side: float):
    """Return the distance between two places of `line_from` [m]; side: of the cells [m]."""
    return 2.0 * _REACH * side / _STEPS


@wp.func
def line_from(where: wp.uint32, turned: wp.uint32):
    """Return (point relative to a corner of the stored places, in `line_step`; direction of any length; radius relative
    to the smallest of `StrandCells.widths`) from the words of `line_of`. The cell's center is at `LINE_CENTRE` along
    each axis.
    """
    mask = wp.uint32(1023)
    # Processors convert several signed integers at once.
    x = float(int(where & mask))
    y = float(int((where >> wp.uint32(10)) & mask))
    z = float(int((where >> wp.uint32(20)) & mask))
    u = float(int(turned & wp.uint32(65535))) - 0.5 * _TURNS
    v = float(int(turned >> wp.uint32(16))) - 0.5 * _TURNS
    w = 0.5 * _TURNS - wp.abs(u) - wp.abs(v)
    below = wp.min(w, 0.0)
    u += wp.where(u < 0.0, -below, below)
    v += wp.where(v < 0.0, -below, below)
    return wp.vec3(x, y, z), wp.vec3(u, v, w), float((1 << (_WIDTHS - 1)) >> int(where >> wp.uint32(30)))


@wp.func
def _halvings_of(hair: _Strands, axis: _Axis):
    """Return how often the largest radius can be halved without becoming smaller than a segment's radius."""
    halvings = int(0)
    width = 0.5 * hair.radius
    while halvings < _WIDTHS - 1 and axis.radius < width:
        halvings += 1
        width *= 0.5
    return halvings


@wp.kernel
def _find(
    hair: _Strands,
    step: int,
    bricks: wp.array[int],
    ends: wp.array[wp.int64],
    first: int,
    out_by_cell: wp.array[int],
    out_is_used: wp.array[int],
    out_cells: wp.array[int],
    out_segments: wp.array[int],
    out_lines: wp.array[wp.uint32],
):
    """Find the cells of each segment, layer by layer, and within a layer row by row, so that only touched cells are
    visited.

    step: `_COUNT` the cells of each segment, and mark their voxels; `_WRITE` cells before the segment's end;
    `_COUNT_BY_CELL` the segments of each cell of all voxels, in the segments' order on one CPU core; `_PUT` segments at
    these cells' next places in the same order.
    """
    segment = first + wp.tid()
    if hair.strands[segment] != hair.strands[segment + 1]:
        if step == _COUNT:
            ends[segment] = wp.int64(0)
        return
    k = hair.along_voxel
    of_division = 65536 // k + 1  # a factor instead of divisions by k, which take longer
    side = hair.voxel / float(k)
    per_side = 1.0 / side
    axis = _axis_of(hair, segment, side)
    halvings = int(0)
    turned = wp.uint32(0)
    count = int(0)
    at = int(0)
    end = int(0)
    if step == _WRITE or step == _PUT:
        halvings = _halvings_of(hair, axis)
        turned = _direction_word(axis.way)
    if step == _WRITE:
        end = int(ends[segment])
        if segment > 0:
            at = int(ends[segment - 1])
    low_z, high_z = _cells_along(hair, axis, 2, 0.0, 1.0, per_side)
    for z in range(low_z, high_z + 1):
        first_z, last_z = _part_in_layer(hair, axis, 2, z, 0.0, 1.0, side)
        if first_z <= last_z:
            voxel_z = (z * of_division) >> 16
            low_y, high_y = _cells_along(hair, axis, 1, first_z, last_z, per_side)
            for y in range(low_y, high_y + 1):
                first_y, last_y = _part_in_layer(hair, axis, 1, y, first_z, last_z, side)
                if first_y <= last_y:
                    voxel_y = (y * of_division) >> 16
                    low_x, high_x = _cells_along(hair, axis, 0, first_y, last_y, per_side)
                    voxel_x = (low_x * of_division) >> 16
                    voxel = (voxel_z * hair.shape[1] + voxel_y) * hair.shape[0] + voxel_x
                    in_voxel = low_x - k * voxel_x
                    in_brick = ((z - k * voxel_z) * k + y - k * voxel_y) * k
                    centre = hair.corner + side * wp.vec3(float(low_x) + 0.5, float(y) + 0.5, float(z) + 0.5)
                    count += high_x - low_x + 1
                    x = int(low_x)
                    while x <= high_x:
                        if step == _COUNT:
                            out_is_used[voxel] = 1
                        elif step == _WRITE:
                            if at < end:
                                out_cells[at] = bricks[voxel] * k * k * k + in_brick + in_voxel
                                out_segments[at] = segment
                                out_lines[2 * at] = _place_word(axis.origin, axis.way, centre, side, halvings)
                                out_lines[2 * at + 1] = turned
                                at += 1
                        else:
                            cell = voxel * k * k * k + in_brick + in_voxel
                            place = out_by_cell[cell]
                            out_by_cell[cell] = place + 1
                            if step == _PUT:
                                out_segments[place] = segment
                                out_lines[2 * place] = _place_word(axis.origin, axis.way, centre, side, halvings)
                                out_lines[2 * place + 1] = turned
                        in_voxel += 1
                        if in_voxel == k:
                            in_voxel = 0
                            voxel += 1
                        centre += wp.vec3(side, 0.0, 0.0)
                        x += 1
    if step == _COUNT:
        ends[segment] = wp.int64(count)


@wp.kernel
def _number(is_used: wp.array[int], ends: wp.array[int], out_bricks: wp.array[int]):
    voxel = wp.tid()
    out_bricks[voxel] = wp.where(is_used[voxel] > 0, ends[voxel] - 1, -1)


@wp.kernel
def _count(cells: wp.array[int], out_counts: wp.array[int]):
    wp.atomic_add(out_counts, cells[wp.tid()], 1)


@wp.kernel
def _mark(counts: wp.array2d[int], in_voxel: int, out_is_used: wp.array[int]):
    voxel = wp.tid()
    for share in range(counts.shape[0]):
        for cell in range(voxel * in_voxel, (voxel + 1) * in_voxel):
            if counts[share, cell] > 0:
                out_is_used[voxel] = 1


@wp.kernel
def _add_shares(counts: wp.array2d[int], bricks: wp.array[int], in_voxel: int, out_total: wp.array[int]):
    voxel = wp.tid()
    if bricks[voxel] >= 0:
        for cell in range(in_voxel):
            total = int(0)
            for share in range(counts.shape[0]):
                total += counts[share, voxel * in_voxel + cell]
            out_total[bricks[voxel] * in_voxel + cell] = total


@wp.kernel
def _begin_shares(starts: wp.array[int], bricks: wp.array[int], in_voxel: int, counts: wp.array2d[int]):
    """Compute for each share of the segments where its entries begin in each cell.

    Entries of earlier shares come first.
    """
    voxel = wp.tid()
    if bricks[voxel] >= 0:
        for cell in range(in_voxel):
            at = starts[bricks[voxel] * in_voxel + cell]
            for share in range(counts.shape[0]):
                count = counts[share, voxel * in_voxel + cell]
                counts[share, voxel * in_voxel + cell] = at
                at += count


@wp.kernel
def _take(
    order: wp.array[int],
    segments: wp.array[int],
    lines: wp.array[wp.uint32],
    out_segments: wp.array[int],
    out_lines: wp.array[wp.uint32],
):
    at = wp.tid()
    entry = order[at]
    out_segments[at] = segments[entry]
    out_lines[2 * at] = lines[2 * entry]
    out_lines[2 * at + 1] = lines[2 * entry + 1]


@wp.kernel
def _rise(out_order: wp.array[int]):
    out_order[wp.tid()] = wp.tid()


def build(
    points: wp.array[wp.vec3],
    radii: wp.array[float],
    strands: wp.array[int],
    radius: float,
    voxels: tuple[np.ndarray, float, tuple[int, int, int]],
    along_voxel: int,
) -> StrandCells:
    """Return the `StrandCells` of points (N,) with radii (N,) [m], on their device.

    strands: (N,) strand index of each point; radius: the largest [m]; voxels: (corner (3,), side [m], numbers along X,
    Y, Z) of voxels that contain all strands, each at least as wide as `along_voxel` strands.
    """
    require_count("radii", len(radii), len(points))
    require_count("strands of points", len(strands), len(points))
    device = points.device
    corner, side, shape = voxels
    with wp.ScopedDevice(device):
        hair = _Strands()
        hair.points, hair.radii, hair.strands, hair.radius = points, radii, strands, radius
        hair.corner, hair.voxel, hair.shape = wp.vec3(*corner.tolist()), side, wp.vec3i(*shape)
        hair.along_voxel = along_voxel
        voxel_count = int(np.prod(shape))
        found = (_by_cores if device.is_cpu else _by_sorting)(hair, voxel_count)
        return StrandCells(along_voxel, radius, *found)


def _find_all(hair, inputs, outputs):
    """Launch `_find` for all segments; outputs: lists of its last arguments for each share of the segments."""
    count = max(len(hair.points) - 1, 0)
    if count:
        parallel.launch_shares(_find, count, [hair, *inputs], outputs, hair.points.device)


def _require_room(count):
    if count > np.iinfo(np.int32).max // 2:  # kernels count both words of each line
        raise HairError("Strands are too wide for light among them: use dual scattering.")


def _numbered(is_used):
    """Return (bricks (V,) of voxels with flags (V,), number of bricks)."""
    device = is_used.device
    numbers, count = running_sums.ends_of(is_used)
    bricks = wp.empty(len(is_used), dtype=int, device=device)
    kernel_cache.launch(_number, len(is_used), [is_used, numbers], [bricks], device)
    return bricks, count


def _nothing(device):
    """Return arrays of (int, int64, uint32) for the arguments that a step of `_find` does not use."""
    return tuple(wp.empty(1, dtype=kind, device=device) for kind in (int, wp.int64, wp.uint32))


def _by_sorting(hair, voxel_count):
    """Return the arrays of `StrandCells` of a GPU: all entries are written, and sorted by cell."""
    device, in_voxel, (none, _, no_lines) = hair.points.device, hair.along_voxel**3, _nothing(hair.points.device)
    is_used = wp.zeros(voxel_count, dtype=int, device=device)
    counts = wp.empty(max(len(hair.points) - 1, 0), dtype=wp.int64, device=device)
    _find_all(hair, [_COUNT, none, counts], [[none, is_used, none, none, no_lines]])
    ends, count = running_sums.ends_of(counts)
    _require_room(count)
    bricks, brick_count = _numbered(is_used)
    cells = wp.empty(2 * count, dtype=int, device=device)  # sorting takes twice the memory
    segments, lines = (wp.empty(count, dtype=int, device=device), wp.empty(2 * count, dtype=wp.uint32, device=device))
    _find_all(hair, [_WRITE, bricks, ends], [[none, none, cells, segments, lines]])
    return bricks, *_sorted(cells, brick_count * in_voxel, segments, lines)


def _by_cores(hair, voxel_count):
    """Return the arrays of `StrandCells` of a CPU: each core puts a share of the segments at their final places,
    because new memory takes longer than another search for cells.
    """
    device, in_voxel, (none, no_ends, no_lines) = hair.points.device, hair.along_voxel**3, _nothing(hair.points.device)
    share_count = parallel.share_count(max(len(hair.points) - 1, 0), device, _LEAST_SEGMENTS)
    counts = wp.zeros((share_count, voxel_count * in_voxel), dtype=int, device=device)
    shares = [counts[share] for share in range(share_count)]
    _find_all(hair, [_COUNT_BY_CELL, none, no_ends], [[share, none, none, none, no_lines] for share in shares])
    count = int(counts.numpy().sum(dtype=np.int64))
    _require_room(count)
    is_used = wp.zeros(voxel_count, dtype=int, device=device)
    kernel_cache.launch(_mark, voxel_count, [counts, in_voxel], [is_used], device)
    bricks, brick_count = _numbered(is_used)
    total, starts = (wp.zeros(brick_count * in_voxel + 1, dtype=int, device=device) for _ in range(2))
    kernel_cache.launch(_add_shares, voxel_count, [counts, bricks, in_voxel], [total], device)
    wp.utils.array_scan(total, starts, inclusive=False)
    kernel_cache.launch(_begin_shares, voxel_count, [starts, bricks, in_voxel, counts], device=device)
    segments, lines = parallel.empty(count, int, device), parallel.empty(2 * count, wp.uint32, device)
    _find_all(hair, [_PUT, none, no_ends], [[share, none, none, segments, lines] for share in shares])
    return bricks, starts, segments, lines


def _sorted(cells, cell_count, segments, lines):
    """Return ((cells + 1,) starts, segments and lines by cell) of M unordered entries, by a radix sort.

    cells: (2 M,), of which the first half is used.
    """
    device, count = cells.device, len(segments)
    counts, starts = (wp.zeros(cell_count + 1, dtype=int, device=device) for _ in range(2))
    order = wp.empty(2 * count, dtype=int, device=device)
    found = parallel.empty(count, int, device), parallel.empty(2 * count, wp.uint32, device)
    kernel_cache.launch(_count, count, [cells], [counts], device)
    wp.utils.array_scan(counts, starts, inclusive=False)
    kernel_cache.launch(_rise, count, outputs=[order], device=device)
    wp.utils.radix_sort_pairs(cells, order, count, end_bit=max(cell_count - 1, 1).bit_length())
    kernel_cache.launch(_take, count, [order, segments, lines], found, device)
    return starts, *found
