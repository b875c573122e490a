# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands as segments in the cells of a grid, for tracing paths of light.

Each cell lists all segments that touch it with their width, so a ray finds the nearest segment with few tests. Very
many strands are thinned out: the remaining strands are wider and block as much light.
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field

import numpy as np
import warp as wp

from ...errors import HairError
from ...kernels import kernel_cache, parallel
from ...kernels.checks import require_count, require_indices
from ..fibre import marschner
from ..fibre.principled import scale_from_radial_roughness
from . import strand_cells

wp.set_module_options({"enable_backward": False, "fast_math": True})

SEGMENT_COUNT = 3_000_000  # greatest number of all strands' segments
VOXEL_COUNT = 375_000
MOST_VOXELS = 200  # along a side
# Maximum cells per voxel side, which are wider than strands; on a processor, which compares a ray with several segments
# at once, larger cells take half of the time to fill.
_CELLS_ALONG_VOXEL, _CELLS_ALONG_VOXEL_ON_GPU = 2, 3
_SIZES_AN_OCTAVE = 4  # of voxels
_LEAST_SEGMENTS = 8  # minimum segments per strand, so that strands can bend
_AT_ONCE = 1000  # strands tested for a positive area
_MOST_ROUNDING = 100.0  # resolution of positions in radii: for hair of a head, ten kilometers from the origin
_MOST_PARTS, _LEAST_PART = 4096, 256  # maximum number of parts of a measurement, and minimum points of a part


@dataclass(frozen=True, eq=False)
class Strands:
    """One system of hair: S strands of P points.

    absorption: function of indices of strands (N,) → sigma_a (N, 2, 3), or (1, 2, 3) if all strands are equal, at root
    and tip; gradient: (P,) fraction of the tip's absorption at each point; fibre: (S,) index of each strand's settings
    among the settings given to `build`; kind: equal for systems with the same strands and look, whose light is summed
    together; None if the light of the system has its own sums; radial: None for the settings' radial roughness.
    """

    points: np.ndarray  # (S, P, 3)
    radii: np.ndarray  # (S, P) in the world [m]
    absorption: Callable[[np.ndarray], np.ndarray]
    gradient: np.ndarray  # (P,)
    roughness: np.ndarray  # (S,) longitudinal, in [0, 1]
    fibre: np.ndarray  # (S,)
    to_world: np.ndarray = field(default_factory=lambda: np.eye(4))  # (4, 4) of points, to [m]
    kind: Hashable | None = None
    radial: np.ndarray | None = None  # (S,)


@dataclass(frozen=True)
class Thinned:
    """Strands of a system in a grid: each `stride`-th, of `point_count` points each, from `first_point` on."""

    stride: int
    point_count: int
    first_point: int


@dataclass(frozen=True, eq=False)
class StrandGrid:
    """S strands of N points in all, and their segments in the cells of voxels (Z, Y, X); (0, 0, 0) is at `corner`.

    Light is averaged by voxel; voxels are cubes.
    """

    corner: np.ndarray  # (3,) [m]
    voxel: float  # side [m]
    shape: tuple[int, int, int]  # voxels along X, Y, Z
    cells: strand_cells.StrandCells
    points: wp.array[wp.vec3]  # (N,) [m]
    radii: wp.array[float]  # (N,) [m]
    sigma_a: wp.array[wp.vec3]  # (N,)
    strands: wp.array[int]  # (N,): the strand of each point
    roughness: wp.array[float]  # (S,)
    scales: wp.array[float]  # (S,): of the azimuthal logistic [rad]
    fibres: wp.array[int]  # (S,): rows of `fibre_rows`
    sums: wp.array[int]  # (S,): the index of the sums that the light of each strand is added to
    fibre_rows: wp.array2d[float]  # (F, 4): ior, tilt, shift of TRT in tilts, coat
    thinned: tuple[Thinned, ...]  # of each system
    sums_of_systems: tuple[int, ...]  # the index of the sums of each system: the same for linked hair

    @property
    def origin(self) -> tuple[int, int, int]:
        """Indices along X, Y, Z of the first voxel, among voxels that fill the world."""
        return tuple(np.rint(self.corner / self.voxel).astype(int).tolist())

    @property
    def is_resolved(self) -> bool:
        """Whether single precision resolves positions to some radii of the widest strand.

        Otherwise paths hit the strand that they leave again and again, and take minutes.
        """
        rounding = max(self.shape) * self.voxel * float(np.finfo(np.float32).eps)
        return bool(rounding <= _MOST_ROUNDING * self.cells.widths[0])

    @property
    def device(self) -> wp.Device:
        """The device of the arrays."""
        return self.points.device


def build(
    systems: Sequence[Strands],
    fibres: Sequence[marschner.Settings],
    segment_count: int = SEGMENT_COUNT,
    voxel_count: int = VOXEL_COUNT,
    device: wp.DeviceLike = "cpu",
) -> StrandGrid:
    """Return the `StrandGrid` of all hair systems; fibres: settings to which `Strands.fibre` refers.

    Raises `HairError` for hair without size, and if counts do not match.
    """
    for strands in systems:
        require_count("radii", strands.radii.size, strands.points.shape[0] * strands.points.shape[1])
        require_count("places of a gradient", len(strands.gradient), strands.points.shape[1])
        require_count("values of roughness", len(strands.roughness), len(strands.points))
        if strands.radial is not None:
            require_count("values of radial roughness", len(strands.radial), len(strands.points))
        require_count("fibers", len(strands.fibre), len(strands.points))
        require_indices("fibers", strands.fibre, len(fibres))
    share = segment_count / max(sum(strands.radii[:, 1:].size for strands in systems), 1)
    chosen = [_chosen(strands, share) for strands in systems]
    counts = [
        len(range(0, len(strands.points), stride)) for strands, (stride, _at) in zip(systems, chosen, strict=True)
    ]
    firsts = np.cumsum([0, *(count * len(at) for count, (_stride, at) in zip(counts, chosen, strict=True))]).tolist()
    thinned = [Thinned(stride, len(at), first) for (stride, at), first in zip(chosen, firsts, strict=False)]
    sums_of_systems = _sums_of(systems)
    with wp.ScopedDevice(device):
        device = wp.get_device()
        arrays = [wp.empty(firsts[-1], dtype=kind) for kind in (wp.vec3, float, wp.vec3, int)]
        for index, (strands, (_stride, at)) in enumerate(zip(systems, chosen, strict=True)):
            rows = slice(firsts[index], firsts[index + 1])
            _thin(strands, thinned[index], at, sum(counts[:index]), [array[rows] for array in arrays])
        points, radii, sigma_a, strand_of_points = arrays
        low, high, widest, area = _measured(points, radii, strand_of_points)
        if not 0.0 < area < np.inf:
            raise HairError("Light needs strands of a length and a width above zero.")
        voxels = _voxels(low, high, widest, voxel_count)
        most_along = _CELLS_ALONG_VOXEL if device.is_cpu else _CELLS_ALONG_VOXEL_ON_GPU
        along_voxel = min(max(int(voxels[1] / (2.0 * widest)), 1), most_along)
        cells = strand_cells.build(points, radii, strand_of_points, widest, voxels, along_voxel)
        strided = [(strands, one.stride) for strands, one in zip(systems, thinned, strict=True)]
        roughness = np.concatenate([strands.roughness[::stride] for strands, stride in strided])
        scales = np.concatenate([_scales(strands, fibres)[::stride] for strands, stride in strided])
        fibre = np.concatenate([strands.fibre[::stride] for strands, stride in strided])
        return StrandGrid(
            *voxels,
            cells,
            points,
            radii,
            sigma_a,
            strand_of_points,
            wp.array(roughness.astype(np.float32), dtype=float),
            wp.array(scales.astype(np.float32), dtype=float),
            wp.array(fibre.astype(np.int32), dtype=int),
            wp.array(np.repeat(np.array(sums_of_systems, np.int32), counts), dtype=int),
            wp.array(np.array([_fibre_row(settings) for settings in fibres], np.float32).reshape(-1, 4), dtype=float),
            tuple(thinned),
            sums_of_systems,
        )


def _sums_of(systems):
    """Return the index of the sums of each system."""
    kinds = [(index, None) if strands.kind is None else strands.kind for index, strands in enumerate(systems)]
    indices = {kind: index for index, kind in enumerate(dict.fromkeys(kinds))}
    return tuple(indices[kind] for kind in kinds)


def has_area(systems: Sequence[Strands]) -> bool:
    """Return whether any strand has a length and a width, so that rays can hit it."""
    for strands in systems:
        turn = strands.to_world[:3, :3].T
        for first in range(0, len(strands.points), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            along = np.diff(strands.points[some], axis=1) @ turn
            if (np.linalg.norm(along, axis=-1) * (strands.radii[some, 1:] + strands.radii[some, :-1])).any():
                return True
    return False


def _chosen(strands, share):
    """Return (stride of strands, indices of points along each) that keep about a fraction of the segments."""
    point_count = strands.points.shape[1]
    most = max(point_count - 1, 1)
    wanted = most  # segments of a strand
    if share < 1.0:
        wanted = max(int(share * most), min(most, _LEAST_SEGMENTS))
    stride = max(1, round(wanted / (share * most))) if share < 1.0 else 1
    return stride, np.rint(np.linspace(0, point_count - 1, wanted + 1)).astype(np.int32)


@wp.kernel
def _keep(
    points: wp.array2d[wp.vec3],
    radii: wp.array2d[float],
    sigma_a: wp.array2d[wp.vec3],
    gradient: wp.array[float],
    at: wp.array[int],
    turn: wp.mat33,
    shift: wp.vec3,
    wider: float,
    first_strand: int,
    out_points: wp.array[wp.vec3],
    out_radii: wp.array[float],
    out_sigma_a: wp.array[wp.vec3],
    out_strands: wp.array[int],
    first: int,
):
    item = first + wp.tid()
    strand = item / at.shape[0]
    point = at[item % at.shape[0]]
    row = wp.min(strand, sigma_a.shape[0] - 1)
    out_points[item] = turn * points[strand, point] + shift
    out_radii[item] = wider * radii[strand, point]
    out_sigma_a[item] = sigma_a[row, 0] + gradient[point] * (sigma_a[row, 1] - sigma_a[row, 0])
    out_strands[item] = first_strand + strand


def _thin(strands, thinned, at, first_strand, outputs):
    """Write the points, radii, sigma_a and strands of the thinned part of a system; first_strand: its index."""
    device, count = outputs[0].device, len(strands.points)
    chosen = np.arange(0, count, thinned.stride)
    sigma_a = np.asarray(strands.absorption(chosen), np.float32)
    require_count("absorptions", len(sigma_a), len(chosen) if len(sigma_a) != 1 else 1)
    to_world = np.asarray(strands.to_world, np.float32)
    points, radii = (
        np.ascontiguousarray(values[:: thinned.stride], np.float32) for values in (strands.points, strands.radii)
    )
    given = [
        wp.array(points, dtype=wp.vec3, ndim=2, copy=False),
        wp.array(radii, dtype=float, ndim=2, copy=False),
        wp.array(sigma_a, dtype=wp.vec3, ndim=2, copy=False),
        wp.array(np.asarray(strands.gradient, np.float32), dtype=float),
        wp.array(at, dtype=int),
        wp.mat33(*to_world[:3, :3].ravel().tolist()),
        wp.vec3(*to_world[:3, 3].tolist()),
        count / max(len(chosen), 1),
        first_strand,
    ]
    parts = parallel.part_count(len(outputs[0]), device)
    if len(outputs[0]):
        parallel.launch_shares(_keep, len(outputs[0]), [*given, *outputs], [[] for _ in range(parts)], device)


@wp.kernel
def _measure(
    points: wp.array[wp.vec3],
    radii: wp.array[float],
    strands: wp.array[int],
    part_size: int,
    out_low: wp.array[wp.vec3],
    out_high: wp.array[wp.vec3],
    out_widest: wp.array[float],
    out_area: wp.array[float],
):
    """Compute the bounds of a part of all points, their largest radius, and the sum of length × width of segments."""
    part = wp.tid()
    start = part * part_size
    low = points[start]
    high = low
    widest = radii[start]
    area = float(0.0)
    for point in range(start, wp.min(start + part_size, points.shape[0])):
        low = wp.min(low, points[point])
        high = wp.max(high, points[point])
        widest = wp.max(widest, radii[point])
        if point + 1 < points.shape[0]:
            if strands[point] == strands[point + 1]:
                area += wp.length(points[point + 1] - points[point]) * (radii[point] + radii[point + 1])
    out_low[part] = low
    out_high[part] = high
    out_widest[part] = widest
    out_area[part] = area


def _measured(points, radii, strands):
    """Return ((3,) least and largest coordinates, largest radius, sum of length × width of segments),
    all zero without points.
    """
    count = len(points)
    if not count:
        return np.zeros(3), np.zeros(3), 0.0, 0.0
    size = max(-(-count // _MOST_PARTS), _LEAST_PART)
    parts = -(-count // size)
    found = [wp.empty(parts, dtype=kind) for kind in (wp.vec3, wp.vec3, float, float)]
    kernel_cache.launch(_measure, parts, [points, radii, strands, size], found, points.device)
    low, high, widest, area = (array.numpy() for array in found)
    return low.min(axis=0), high.max(axis=0), float(widest.max()), float(area.sum(dtype=np.float64))


def _voxels(low, high, radius, voxel_count):
    """Return (corner, side, numbers along X, Y, Z) of voxels around all strands.

    low, high: (3,) bounds of their points. Voxels have fixed places in the world while hair moves, and one of a few
    sizes, so that averages by voxel change no more than the hair.
    """
    low, high = low.astype(np.float64) - radius, high.astype(np.float64) + radius
    least = 1e-6 * max(float((high - low).max()), 1e-6)
    size = np.maximum(high - low, least)
    side = max(float(np.prod(size) / voxel_count) ** (1.0 / 3.0), float(size.max()) / (MOST_VOXELS - 2), 2.0 * radius)
    side = float(2.0 ** (np.ceil(_SIZES_AN_OCTAVE * np.log2(side)) / _SIZES_AN_OCTAVE))
    first = np.floor(low / side)
    shape = (np.floor(high / side) - first + 1.0).astype(int)
    return first * side, side, tuple(shape.tolist())


def _fibre_row(settings):
    tilt_trt = 4.0 if settings.shifts == "CYCLES" else 3.0
    return settings.eta, settings.tilt, tilt_trt, settings.coat


def _scales(strands, fibres):
    """Return the scales (S,) of the azimuthal logistic."""
    if strands.radial is not None:
        return scale_from_radial_roughness(strands.radial.astype(float))
    return np.array([float(scale_from_radial_roughness(each.radial_roughness)) for each in fibres])[strands.fibre]
