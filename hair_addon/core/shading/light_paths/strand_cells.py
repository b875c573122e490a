# SPDX-License-Identifier: GPL-3.0-or-later
"""Which segments of strands are in which cells: voxels that hold hair are divided into cells, all others are empty.

A path waits for memory longer than for arithmetic. So each cell has the lines that its segments lie on next to each
other, of eight bytes each: most segments are told from them not to be near a ray, without being read.
"""

from dataclasses import dataclass

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import parallel

wp.set_module_options({"enable_backward": False, "fast_math": True})

_LEAST_SEGMENTS = 20_000  # fewer are not worth a thread
_MOST_PARTS = wp.constant(1600)  # of a segment, each about as long as two cells
_WIDER = wp.constant(1e-4)  # part of a cell by which segments are taken as wider, for rounding
_REACH = wp.constant(1.7321)  # cells from a cell's centre to the nearest point of a line, at most
_STEPS = wp.constant(1023.0)  # of that point, along each axis
_TURNS = wp.constant(65535.0)  # steps of a line's direction, along both axes
LINE_ERROR = wp.constant(0.004)  # cells between a line and what is kept of it, at most
_WIDTHS = wp.constant(4)  # that segments are taken to have, each half the one before


@dataclass(frozen=True, eq=False)
class StrandCells:
    """Segments in the cells of V voxels, of which B are divided into K³ cells."""

    along_voxel: int  # K
    radius: float  # the largest [m]
    bricks: np.ndarray  # (V,) int32: of each voxel, which of those that are divided it is; -1: it is empty
    starts: np.ndarray  # (B K³ + 1,) int32: first of each cell in `segments`
    segments: np.ndarray  # (M,) int32: first points of segments, once for each cell that they are in
    lines: np.ndarray  # (M, 2) uint32: of those `line_of`

    @property
    def widths(self) -> np.ndarray:
        """(4,) radii that segments are taken to have [m]: the largest, and each half the one before."""
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
    """A segment's axis: from `origin` + first `way` to `origin` + last `way` where only a part of it is meant."""

    origin: wp.vec3
    way: wp.vec3
    inverse: wp.vec3  # one over `way`
    radius: float


@wp.func
def _axis_of(hair: _Strands, segment: int, side: float):
    """The axis of a whole segment; side: of the cells that it is looked for in [m]."""
    axis = _Axis()
    axis.origin = hair.points[segment]
    axis.way = hair.points[segment + 1] - axis.origin
    axis.radius = wp.max(hair.radii[segment], hair.radii[segment + 1]) + _WIDER * side
    for along in range(3):
        # What is as long as nothing is inside of a cell or outside, wherever it begins.
        length = axis.way[along]
        if wp.abs(length) < 1e-20:
            length = 1e-20
        axis.inverse[along] = 1.0 / length
    return axis


@wp.func
def _is_in_cell(axis: _Axis, first: float, last: float, low: wp.vec3, side: float):
    """Whether a part of a segment comes into a cell with its width."""
    enter = first
    leave = last
    for along in range(3):
        one = (low[along] - axis.radius - axis.origin[along]) * axis.inverse[along]
        other = (low[along] + side + axis.radius - axis.origin[along]) * axis.inverse[along]
        enter = wp.max(enter, wp.min(one, other))
        leave = wp.min(leave, wp.max(one, other))
    return enter <= leave


@wp.func
def _range_of(hair: _Strands, axis: _Axis, first: float, last: float, side: float):
    """(first, last) cells along X, Y, Z of the box around a part of a segment."""
    a = axis.origin + first * axis.way
    b = axis.origin + last * axis.way
    low = wp.vec3i(0, 0, 0)
    high = wp.vec3i(0, 0, 0)
    for along in range(3):
        most = hair.shape[along] * hair.along_voxel - 1
        least = (wp.min(a[along], b[along]) - axis.radius - hair.corner[along]) / side
        largest = (wp.max(a[along], b[along]) + axis.radius - hair.corner[along]) / side
        low[along] = wp.clamp(int(wp.floor(least)), 0, most)
        high[along] = wp.clamp(int(wp.floor(largest)), 0, most)
    return low, high


@wp.func
def line_of(origin: wp.vec3, way: wp.vec3, centre: wp.vec3, side: float, halvings: int):
    """(two words) of a line along a way: its point that is nearest to a cell's centre, of ten bits along each axis;
    halvings: of the widest radius, to that of the segment; and its direction on an octahedron [Meyer10], of 16 bits
    along both axes.
    """
    part = wp.dot(centre - origin, way) / wp.max(wp.dot(way, way), 1e-30)
    nearest = (origin + part * way - centre) / (2.0 * _REACH * side) + wp.vec3(0.5, 0.5, 0.5)
    where = wp.uint32(halvings) << wp.uint32(30)
    for axis in range(3):
        step = wp.clamp(int(nearest[axis] * _STEPS + 0.5), 0, int(_STEPS))
        where = where | (wp.uint32(step) << wp.uint32(10 * axis))
    flat = way / wp.max(wp.abs(way[0]) + wp.abs(way[1]) + wp.abs(way[2]), 1e-30)
    x = flat[0]
    y = flat[1]
    if flat[2] < 0.0:
        x = (1.0 - wp.abs(flat[1])) * wp.where(flat[0] < 0.0, -1.0, 1.0)
        y = (1.0 - wp.abs(flat[0])) * wp.where(flat[1] < 0.0, -1.0, 1.0)
    turned = wp.uint32((0.5 + 0.5 * x) * _TURNS + 0.5) | (wp.uint32((0.5 + 0.5 * y) * _TURNS + 0.5) << wp.uint32(16))
    return where, turned


@wp.func
def line_from(where: wp.uint32, turned: wp.uint32, side: float):
    """(point from the cell's centre, along the line: of any length, halvings) of the words of `line_of`."""
    mask = wp.uint32(1023)
    scale = 2.0 * _REACH * side / _STEPS
    point = wp.vec3(float(where & mask), float((where >> wp.uint32(10)) & mask), float((where >> wp.uint32(20)) & mask))
    middle = _REACH * side
    x = float(turned & wp.uint32(65535)) * (2.0 / _TURNS) - 1.0
    y = float(turned >> wp.uint32(16)) * (2.0 / _TURNS) - 1.0
    z = 1.0 - wp.abs(x) - wp.abs(y)
    below = wp.max(-z, 0.0)
    x -= wp.where(x < 0.0, -below, below)
    y -= wp.where(y < 0.0, -below, below)
    return scale * point - wp.vec3(middle, middle, middle), wp.vec3(x, y, z), int(where >> wp.uint32(30))


@wp.kernel
def _register(
    hair: _Strands,
    bricks: wp.array[int],
    is_counting: int,
    first: int,
    out_ends: wp.array[int],
    out_segments: wp.array[int],
    out_lines: wp.array2d[wp.uint32],
):
    """Count the segments of each cell, or fill each cell's from the end before it on."""
    segment = first + wp.tid()
    if hair.strands[segment] != hair.strands[segment + 1]:
        return
    k = hair.along_voxel
    side = hair.voxel / float(k)
    axis = _axis_of(hair, segment, side)
    halvings = int(0)
    width = 0.5 * hair.radius
    while halvings < _WIDTHS - 1 and axis.radius < width:
        halvings += 1
        width *= 0.5
    parts = 1 + wp.clamp(int(wp.length(axis.way) / (2.0 * side)), 0, _MOST_PARTS)
    step = 1.0 / float(parts)
    before_low = wp.vec3i(0, 0, 0)
    before_high = wp.vec3i(-1, -1, -1)
    for part in range(parts):
        start = step * float(part)
        low, high = _range_of(hair, axis, start, start + step, side)
        for z in range(low[2], high[2] + 1):
            for y in range(low[1], high[1] + 1):
                for x in range(low[0], high[0] + 1):
                    corner = hair.corner + side * wp.vec3(float(x), float(y), float(z))
                    if _is_in_cell(axis, start, start + step, corner, side):
                        is_known = x >= before_low[0] and y >= before_low[1] and z >= before_low[2]
                        is_known = is_known and x <= before_high[0] and y <= before_high[1] and z <= before_high[2]
                        if is_known:
                            is_known = _is_in_cell(axis, start - step, start, corner, side)
                        brick = bricks[((z / k) * hair.shape[1] + y / k) * hair.shape[0] + x / k]
                        if brick >= 0 and not is_known:
                            cell = ((brick * k + z % k) * k + y % k) * k + x % k
                            at = wp.atomic_add(out_ends, cell, 1)
                            if is_counting == 0:
                                centre = corner + 0.5 * wp.vec3(side, side, side)
                                where, turned = line_of(axis.origin, axis.way, centre, side, halvings)
                                out_segments[at] = segment
                                out_lines[at, 0] = where
                                out_lines[at, 1] = turned
        before_low = low
        before_high = high


def build(
    points: np.ndarray,
    radii: np.ndarray,
    strands: np.ndarray,
    voxels: tuple[np.ndarray, float, tuple[int, int, int]],
    along_voxel: int,
    device: wp.DeviceLike = "cpu",
) -> StrandCells:
    """The cells of strands of points (N, 3) with radii (N,) [m], of which (N,) tells whose point it is.

    voxels: corner (3,) and side [m], and numbers along X, Y, Z, of voxels that hold all strands, each at least as wide
    as `along_voxel` strands.
    """
    corner, side, shape = voxels
    with wp.ScopedDevice(device):
        hair = _Strands()
        hair.points, hair.radii = wp.array(points, dtype=wp.vec3), wp.array(radii, dtype=float)
        hair.strands, hair.radius = wp.array(strands, dtype=int), float(radii.max())
        hair.corner, hair.voxel, hair.shape = wp.vec3(*corner.tolist()), side, wp.vec3i(*shape)
        hair.along_voxel = 1
        numbers = np.arange(int(np.prod(shape)), dtype=np.int32)
        is_used = sum(_counts(hair, numbers, len(numbers), device)) > 0
        bricks = np.where(is_used, np.cumsum(is_used, dtype=np.int32) - 1, -1).astype(np.int32)
        hair.along_voxel = along_voxel
        starts, ends = _ends(_counts(hair, bricks, int(bricks.max()) + 1, device))
        count = int(starts[-1])
        segments, lines = wp.empty(count, dtype=int), wp.empty((count, 2), dtype=wp.uint32)
        outputs = [[wp.array(one, dtype=int), segments, lines] for one in ends]
        given = [hair, wp.array(bricks, dtype=int), 0]
        parallel.launch_shares(_register, len(points) - 1, given, outputs, device)
        return StrandCells(along_voxel, hair.radius, bricks, starts, segments.numpy(), lines.numpy())


def _counts(hair, bricks, brick_count, device):
    """Of each share of the segments how many are in each cell."""
    count = len(hair.points) - 1
    shares = parallel.share_count(count, device, _LEAST_SEGMENTS)
    found = [wp.zeros(brick_count * hair.along_voxel**3, dtype=int) for _ in range(shares)]
    nothing = [wp.empty(1, dtype=int), wp.empty((1, 2), dtype=wp.uint32)]
    given = [hair, wp.array(bricks, dtype=int), 1]
    parallel.launch_shares(_register, count, given, [[one, *nothing] for one in found], device)
    return [one.numpy() for one in found]


def _ends(counts):
    """((cells + 1,) first of each cell in all, for each share of the segments where its own begin)."""
    total = counts[0].astype(np.int64)
    for one in counts[1:]:
        total += one
    starts = np.zeros(len(total) + 1, np.int64)
    np.cumsum(total, out=starts[1:])
    if starts[-1] > np.iinfo(np.int32).max // 2:  # kernels count both words of each line
        raise HairError("Strands are too wide for light among them: use dual scattering.")
    ends, before = [], starts[:-1].astype(np.int32)
    for one in counts:
        ends.append(before)
        before = before + one
    return starts.astype(np.int32), ends
