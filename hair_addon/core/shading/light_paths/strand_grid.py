# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands as segments in the cells of a grid, for paths of light that meet them.

Every segment is in each cell that it touches with its width, so a path that walks from cell to cell finds the nearest
one by few tests. Very many strands are thinned out: the rest is wider, and stops as much light.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import kernel_cache
from ...kernels.checks import require_count, require_indices
from ..fibre import marschner
from ..fibre.principled import scale_from_radial_roughness

wp.set_module_options({"enable_backward": False, "fast_math": True})

SEGMENT_COUNT = 3_000_000  # at most, of all strands
CELL_COUNT = 3_000_000
MOST_CELLS = 400  # along a side
CELLS_A_VOXEL = 2  # along a side of the voxels that light is averaged in
_SIZES_AN_OCTAVE = 4  # of cells
_LEAST_SEGMENTS = 8  # of a strand, that it can bend
_MOST_PARTS = wp.constant(2 * MOST_CELLS)  # of a segment, each about as long as a cell


@dataclass(frozen=True, eq=False)
class Strands:
    """One system of hair: S strands of P points in the world.

    absorption: function of indices of strands (N,) and places along them (N,), root 0 to tip 1, → sigma_a (N, 3);
    fibre: (S,) index of each strand's settings among those given to `build`.
    """

    points: np.ndarray  # (S, P, 3) [m]
    radii: np.ndarray  # (S, P) [m]
    absorption: Callable[[np.ndarray, np.ndarray], np.ndarray]
    roughness: np.ndarray  # (S,) longitudinal, in [0, 1]
    fibre: np.ndarray  # (S,)


@dataclass(frozen=True)
class Kept:
    """Strands of a system in a grid: each `stride`-th, of `point_count` points each, from `first_point` on."""

    stride: int
    point_count: int
    first_point: int


@dataclass(frozen=True, eq=False)
class StrandGrid:
    """S strands of N points in all, and their segments in the order of cells (Z, Y, X); (0, 0, 0) is at `corner`."""

    corner: np.ndarray  # (3,) [m]
    cell: np.ndarray  # (3,) sides [m]
    shape: tuple[int, int, int]  # X, Y, Z: multiples of `CELLS_A_VOXEL`
    starts: np.ndarray  # (cells + 1,) int32: first of each in `segments`
    segments: np.ndarray  # (M,) int32: first points of segments, once for each cell that they are in
    points: np.ndarray  # (N, 3) float32 [m]
    radii: np.ndarray  # (N,) float32 [m]
    sigma_a: np.ndarray  # (N, 3) float32
    strands: np.ndarray  # (N,) int32: whose point it is
    roughness: np.ndarray  # (S,) float32
    fibres: np.ndarray  # (S,) int32: rows of `fibre_rows`
    systems: np.ndarray  # (S,) int32: which hair
    fibre_rows: np.ndarray  # (F, 5) float32: ior, azimuthal scale, tilt, shift of TRT in tilts, coat
    kept: tuple[Kept, ...]  # of each system

    @property
    def origin(self) -> tuple[int, int, int]:
        """Numbers along X, Y, Z of the first voxel, of all that fill the world."""
        first = np.rint(self.corner / (self.cell * CELLS_A_VOXEL)).astype(int)
        return tuple(first.tolist())

    @property
    def voxels(self) -> tuple[int, int, int]:
        """Number of voxels along X, Y, Z."""
        x, y, z = self.shape
        return x // CELLS_A_VOXEL, y // CELLS_A_VOXEL, z // CELLS_A_VOXEL


@wp.func
def _touches(a: wp.vec3, b: wp.vec3, centre: wp.vec3, reach: float):
    """Whether the part from a to b comes within a reach of a cell's centre."""
    along = b - a
    t = wp.clamp(wp.dot(centre - a, along) / wp.max(wp.dot(along, along), 1e-30), 0.0, 1.0)
    return wp.length(a + t * along - centre) < reach


@wp.kernel
def _register(
    points: wp.array[wp.vec3],
    radii: wp.array[float],
    strands: wp.array[int],
    corner: wp.vec3,
    cell: wp.vec3,
    shape: wp.vec3i,
    is_counting: int,
    out_ends: wp.array[int],
    out_segments: wp.array[int],
):
    """Count the segments of each cell, or fill each cell's from the end before it on."""
    first = wp.tid()
    if strands[first] == strands[first + 1]:
        radius = wp.max(radii[first], radii[first + 1])
        start = points[first]
        along = points[first + 1] - start
        parts = 1 + wp.clamp(int(wp.length(along) / wp.min(cell)), 0, _MOST_PARTS)
        reach = radius + 0.5 * wp.length(cell)
        before_a = start
        before_b = start
        before_low = wp.vec3i(0, 0, 0)
        before_high = wp.vec3i(-1, -1, -1)
        for part in range(parts):
            a = start + along * (float(part) / float(parts))
            b = start + along * (float(part + 1) / float(parts))
            low = wp.vec3i(0, 0, 0)
            high = wp.vec3i(0, 0, 0)
            for axis in range(3):
                least = (wp.min(a[axis], b[axis]) - radius - corner[axis]) / cell[axis]
                most = (wp.max(a[axis], b[axis]) + radius - corner[axis]) / cell[axis]
                low[axis] = wp.clamp(int(wp.floor(least)), 0, shape[axis] - 1)
                high[axis] = wp.clamp(int(wp.floor(most)), 0, shape[axis] - 1)
            for z in range(low[2], high[2] + 1):
                for y in range(low[1], high[1] + 1):
                    for x in range(low[0], high[0] + 1):
                        middle = wp.vec3(float(x) + 0.5, float(y) + 0.5, float(z) + 0.5)
                        centre = corner + wp.cw_mul(middle, cell)
                        is_known = x >= before_low[0] and y >= before_low[1] and z >= before_low[2]
                        is_known = is_known and x <= before_high[0] and y <= before_high[1] and z <= before_high[2]
                        is_known = is_known and _touches(before_a, before_b, centre, reach)
                        if not is_known and _touches(a, b, centre, reach):
                            index = (z * shape[1] + y) * shape[0] + x
                            at = wp.atomic_add(out_ends, index, 1)
                            if is_counting == 0:
                                out_segments[at] = first
            before_a = a
            before_b = b
            before_low = low
            before_high = high


def build(
    systems: Sequence[Strands],
    fibres: Sequence[marschner.Settings],
    segment_count: int = SEGMENT_COUNT,
    cell_count: int = CELL_COUNT,
    device: wp.DeviceLike = "cpu",
) -> StrandGrid:
    """The grid of all `Strands`; fibres: settings that their `fibre` counts.

    Raises `HairError` for hair without size, and where counts do not match.
    """
    for strands in systems:
        require_count("radii", strands.radii.size, strands.points.shape[0] * strands.points.shape[1])
        require_count("values of roughness", len(strands.roughness), len(strands.points))
        require_count("fibers", len(strands.fibre), len(strands.points))
        require_indices("fibers", strands.fibre, len(fibres))
    if not 0.0 < sum(float(_segment_areas(strands).sum()) for strands in systems) < np.inf:
        raise HairError("Light needs strands of a length and a width above zero.")
    share = segment_count / max(sum(strands.radii[:, 1:].size for strands in systems), 1)
    kept, parts, point_count = [], [], 0
    for strands in systems:
        found, *part = _thinned(strands, share)
        kept.append(Kept(*found, point_count))
        parts.append(part)
        point_count += len(part[0])
    points, radii, sigma_a = (np.concatenate([part[index] for part in parts]) for index in range(3))
    roughness, fibre = (np.concatenate([part[index] for part in parts]) for index in (3, 4))
    counts = [len(part[3]) for part in parts]
    strand_of_points = np.repeat(
        np.arange(sum(counts), dtype=np.int32), np.repeat([one.point_count for one in kept], counts)
    )
    corner, cell, shape = _cells(points, float(radii.max()), cell_count)
    starts, segments = _registered(points, radii, strand_of_points, (corner, cell, shape), device)
    return StrandGrid(
        corner,
        cell,
        shape,
        starts,
        segments,
        points,
        radii,
        sigma_a,
        strand_of_points,
        roughness.astype(np.float32),
        fibre.astype(np.int32),
        np.repeat(np.arange(len(counts), dtype=np.int32), counts),
        np.array([_fibre_row(settings) for settings in fibres], np.float32),
        tuple(kept),
    )


def has_area(systems: Sequence[Strands]) -> bool:
    """Whether any strand has a length and a width, which light could meet."""
    return any(_segment_areas(strands).any() for strands in systems)


def segment_of(grid: StrandGrid, system: int, strands: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(N,) segments of a grid that show strands (N,) of a system at places (N,) along them, root 0 to tip 1."""
    kept = grid.kept[system]
    along = np.clip((places * (kept.point_count - 1)).astype(int), 0, kept.point_count - 2)
    return kept.first_point + strands // kept.stride * kept.point_count + along


def _segment_areas(strands):
    """(S, P - 1) length × width of segments [m²]."""
    lengths = np.linalg.norm(np.diff(strands.points, axis=1), axis=-1)
    return lengths * (strands.radii[:, 1:] + strands.radii[:, :-1])


def _thinned(strands, share):
    """((stride, point count), points (N, 3), radii, sigma_a, roughness, fibre) with about a share of the segments."""
    count, point_count = strands.radii.shape
    most = max(point_count - 1, 1)
    wanted = most  # segments of a strand
    if share < 1.0:
        wanted = max(int(share * most), min(most, _LEAST_SEGMENTS))
    stride = max(1, round(wanted / (share * most))) if share < 1.0 else 1
    at = np.rint(np.linspace(0, point_count - 1, wanted + 1)).astype(int)
    chosen = np.arange(0, count, stride)
    points = strands.points[chosen][:, at].reshape(-1, 3).astype(np.float32)
    radii = (strands.radii[chosen][:, at] * (count / len(chosen))).reshape(-1).astype(np.float32)
    along = np.tile(at / most, len(chosen))
    sigma_a = strands.absorption(np.repeat(chosen, len(at)), along)
    found = stride, len(at)
    return found, points, radii, sigma_a.astype(np.float32), strands.roughness[chosen], strands.fibre[chosen]


def _cells(places, radius, cell_count):
    """(corner, sides, numbers along X, Y, Z) of cells around all strands: cubes.

    They stay where they are in the world while hair moves, and their size is one of a few: what is averaged by voxel
    changes no more than the hair does.
    """
    low, high = places.min(axis=0).astype(np.float64) - radius, places.max(axis=0).astype(np.float64) + radius
    least = 1e-6 * max(float((high - low).max()), 1e-6)
    size = np.maximum(high - low, least)
    cell = max(float(np.prod(size) / cell_count) ** (1.0 / 3.0), float(size.max()) / (MOST_CELLS - 4), radius)
    cell = 2.0 ** (np.ceil(_SIZES_AN_OCTAVE * np.log2(cell)) / _SIZES_AN_OCTAVE)
    voxel = cell * CELLS_A_VOXEL
    first = np.floor(low / voxel)
    shape = (np.floor(high / voxel) - first + 1.0).astype(int) * CELLS_A_VOXEL
    return first * voxel, np.full(3, cell), tuple(shape.tolist())


def _registered(points, radii, strands, cells, device):
    """(starts, segments) of `StrandGrid`."""
    corner, cell, shape = cells
    with wp.ScopedDevice(device):
        given = [wp.array(points, dtype=wp.vec3), wp.array(radii, dtype=float), wp.array(strands, dtype=int)]
        given += [wp.vec3(*corner.tolist()), wp.vec3(*cell.tolist()), wp.vec3i(*shape)]
        counts = wp.zeros(int(np.prod(shape)), dtype=int)
        none = wp.zeros(1, dtype=int)
        kernel_cache.launch(_register, len(points) - 1, [*given, 1, counts, none], device=device)
        starts = np.zeros(len(counts) + 1, np.int64)
        np.cumsum(counts.numpy(), out=starts[1:])
        if starts[-1] > np.iinfo(np.int32).max:
            raise HairError("Strands are too wide for light among them: use dual scattering.")
        ends, segments = wp.array(starts[:-1], dtype=int), wp.zeros(max(int(starts[-1]), 1), dtype=int)
        kernel_cache.launch(_register, len(points) - 1, [*given, 0, ends, segments], device=device)
        return starts.astype(np.int32), segments.numpy()


def _fibre_row(settings):
    tilt_trt = 4.0 if settings.shifts == "CYCLES" else 3.0
    scale = float(scale_from_radial_roughness(settings.radial_roughness))
    return settings.eta, scale, settings.tilt, tilt_trt, settings.coat
