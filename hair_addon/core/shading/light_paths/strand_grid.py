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
from ...kernels.checks import require_count, require_indices
from ..fibre import marschner
from ..fibre.principled import scale_from_radial_roughness
from . import strand_cells

SEGMENT_COUNT = 3_000_000  # at most, of all strands
VOXEL_COUNT = 375_000
MOST_VOXELS = 200  # along a side
CELLS_ALONG_VOXEL = 3  # at most: cells are wider than strands
_SIZES_AN_OCTAVE = 4  # of voxels
_LEAST_SEGMENTS = 8  # of a strand, that it can bend
_AT_ONCE = 1000  # strands that are looked at for any area


@dataclass(frozen=True, eq=False)
class Strands:
    """One system of hair: S strands of P points in the world.

    absorption: function of indices of strands (N, 1) and places along them (P,), root 0 to tip 1, → sigma_a (N, P, 3);
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
    """S strands of N points in all, and their segments in the cells of voxels (Z, Y, X); (0, 0, 0) is at `corner`.

    Voxels are cubes, which light is averaged in.
    """

    corner: np.ndarray  # (3,) [m]
    voxel: float  # side [m]
    shape: tuple[int, int, int]  # voxels along X, Y, Z
    cells: strand_cells.StrandCells
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
        return tuple(np.rint(self.corner / self.voxel).astype(int).tolist())

    def voxels_at(self, places: np.ndarray) -> np.ndarray:
        """(N, 3) int64 numbers along X, Y, Z of the voxels that hold places (N, 3), the nearest beside the grid."""
        at = (places - self.corner.astype(np.float32)) * np.float32(1.0 / self.voxel)
        return at.astype(np.int64).clip(0, np.array(self.shape) - 1)


def build(
    systems: Sequence[Strands],
    fibres: Sequence[marschner.Settings],
    segment_count: int = SEGMENT_COUNT,
    voxel_count: int = VOXEL_COUNT,
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
    if not 0.0 < sum(float(_segment_areas(strands.points, strands.radii).sum()) for strands in systems) < np.inf:
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
    voxels = _voxels(points, float(radii.max()), voxel_count)
    along_voxel = min(max(int(voxels[1] / (2.0 * radii.max())), 1), CELLS_ALONG_VOXEL)
    cells = strand_cells.build(points, radii, strand_of_points, voxels, along_voxel, device)
    return StrandGrid(
        *voxels,
        cells,
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
    return any(
        _segment_areas(strands.points[first : first + _AT_ONCE], strands.radii[first : first + _AT_ONCE]).any()
        for strands in systems
        for first in range(0, len(strands.points), _AT_ONCE)
    )


def segment_of(grid: StrandGrid, system: int, strands: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(N,) segments of a grid that show strands (N,) of a system at places (N,) along them, root 0 to tip 1."""
    kept = grid.kept[system]
    along = np.clip((places * (kept.point_count - 1)).astype(int), 0, kept.point_count - 2)
    return kept.first_point + strands // kept.stride * kept.point_count + along


def _segment_areas(points, radii):
    """(S, P - 1) length × width of segments [m²] of strands (S, P, 3) with radii (S, P)."""
    along = np.diff(points, axis=1)
    lengths = np.sqrt(np.einsum("spc,spc->sp", along, along))
    return lengths * (radii[:, 1:] + radii[:, :-1])


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
    sigma_a = strands.absorption(chosen[:, None], at / most).astype(np.float32).reshape(-1, 3)
    found = stride, len(at)
    return found, points, radii, sigma_a, strands.roughness[chosen], strands.fibre[chosen]


def _voxels(places, radius, voxel_count):
    """(corner, side, numbers along X, Y, Z) of voxels around all strands.

    They stay where they are in the world while hair moves, and their size is one of a few: what is averaged by voxel
    changes no more than the hair does.
    """
    # Column by column: NumPy is slow along the long axis of narrow arrays.
    low, high = (np.array([end(column) for column in places.T], np.float64) for end in (np.min, np.max))
    low, high = low - radius, high + radius
    least = 1e-6 * max(float((high - low).max()), 1e-6)
    size = np.maximum(high - low, least)
    side = max(float(np.prod(size) / voxel_count) ** (1.0 / 3.0), float(size.max()) / (MOST_VOXELS - 2), 2.0 * radius)
    side = float(2.0 ** (np.ceil(_SIZES_AN_OCTAVE * np.log2(side)) / _SIZES_AN_OCTAVE))
    first = np.floor(low / side)
    shape = (np.floor(high / side) - first + 1.0).astype(int)
    return first * side, side, tuple(shape.tolist())


def _fibre_row(settings):
    tilt_trt = 4.0 if settings.shifts == "CYCLES" else 3.0
    scale = float(scale_from_radial_roughness(settings.radial_roughness))
    return settings.eta, scale, settings.tilt, tilt_trt, settings.coat
