# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands as a medium: pieces of equal area in the cells of a grid.

Light meets a strand in proportion to its length, its width and the sine between its tangent and the light. So strands
are cut into pieces of equal length × width; how many are in a cell says how dense it is, and a piece drawn from them
has the tangents, colors and roughness that are there. [Moon08] stores a mean direction and a spread instead.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import HairError
from ...kernels.checks import require_count, require_indices
from ..fibre import marschner
from ..fibre.principled import scale_from_radial_roughness

PIECE_COUNT = 1_500_000  # of all strands: most cells are empty
_PIECES_A_SEGMENT = 64  # of few strands, at most
CELL_COUNT = 3_000_000
MOST_CELLS = 400  # along a side
CELLS_A_VOXEL = 2  # along a side of the voxels that light is averaged in


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


@dataclass(frozen=True, eq=False)
class StrandGrid:
    """N pieces of strands in the order of the cells (Z, Y, X) that they are in; cell (0, 0, 0) is at `corner`."""

    corner: np.ndarray  # (3,) [m]
    cell: np.ndarray  # (3,) sides [m]
    shape: tuple[int, int, int]  # X, Y, Z: multiples of `CELLS_A_VOXEL`
    area: float  # length × width of a piece [m²]
    starts: np.ndarray  # (cells + 1,) first piece of each
    tangents: np.ndarray  # (N, 3) float32, unit
    sigma_a: np.ndarray  # (N, 3) float32
    roughness: np.ndarray  # (N,) float32
    fibres: np.ndarray  # (N,) int32: rows of `fibre_rows`
    systems: np.ndarray  # (N,) int32: which hair
    strands: np.ndarray  # (N,) int32: which strand of all hair
    fibre_rows: np.ndarray  # (F, 5) float32: ior, azimuthal scale, tilt, shift of TRT in tilts, coat

    @property
    def voxels(self) -> tuple[int, int, int]:
        """Number of voxels along X, Y, Z."""
        x, y, z = self.shape
        return x // CELLS_A_VOXEL, y // CELLS_A_VOXEL, z // CELLS_A_VOXEL


def build(
    systems: Sequence[Strands],
    fibres: Sequence[marschner.Settings],
    piece_count: int = PIECE_COUNT,
    cell_count: int = CELL_COUNT,
) -> StrandGrid:
    """The grid of all `Strands`; fibres: settings that their `fibre` counts.

    Raises `HairError` for hair without size, and where counts do not match.
    """
    for strands in systems:
        require_count("radii", strands.radii.size, strands.points.shape[0] * strands.points.shape[1])
        require_count("values of roughness", len(strands.roughness), len(strands.points))
        require_count("fibers", len(strands.fibre), len(strands.points))
        require_indices("fibers", strands.fibre, len(fibres))
    areas = [_segment_areas(strands) for strands in systems]
    total = float(sum(area.sum() for area in areas))
    if not 0.0 < total < np.inf:
        raise HairError("Light needs strands of a length and a width above zero.")
    random = np.random.default_rng(0)
    piece_count = min(piece_count, _PIECES_A_SEGMENT * sum(area.size for area in areas))
    counts = [max(1, round(piece_count * float(area.sum()) / total)) for area in areas]
    pieces = [_cut(*each, random) for each in zip(systems, areas, counts, strict=True)]
    places, tangents, sigma_a, roughness, fibre, strand = map(np.concatenate, zip(*pieces, strict=True))
    before = np.cumsum([0, *(len(strands.points) for strands in systems)])[:-1]
    corner, cell, shape = _cells(places, cell_count)
    x, y, z = np.minimum(((places - corner) / cell).astype(int), np.array(shape) - 1).T
    within = (z * shape[1] + y) * shape[0] + x
    order = np.argsort(within, kind="stable")
    starts = np.zeros(int(np.prod(shape)) + 1, np.int32)
    np.cumsum(np.bincount(within, minlength=len(starts) - 1), out=starts[1:])
    return StrandGrid(
        corner,
        cell,
        shape,
        total / len(places),
        starts,
        tangents[order].astype(np.float32),
        sigma_a[order].astype(np.float32),
        roughness[order].astype(np.float32),
        fibre[order].astype(np.int32),
        np.repeat(np.arange(len(counts), dtype=np.int32), counts)[order],
        (strand + np.repeat(before, counts))[order].astype(np.int32),
        np.array([_fibre_row(settings) for settings in fibres], np.float32),
    )


def has_area(systems: Sequence[Strands]) -> bool:
    """Whether any strand has a length and a width, which light could meet."""
    return any(_segment_areas(strands).any() for strands in systems)


def _segment_areas(strands):
    """(S, P - 1) length × width of segments [m²]."""
    lengths = np.linalg.norm(np.diff(strands.points, axis=1), axis=-1)
    return lengths * (strands.radii[:, 1:] + strands.radii[:, :-1])


def _cut(strands, areas, count, random):
    """Places (N, 3), tangents, sigma_a, roughness, fibre and strand of `count` pieces of equal area."""
    ends = np.cumsum(areas.ravel(), dtype=np.float64)
    wanted = (np.arange(count) + random.random(count)) / count * ends[-1]
    segment = np.minimum(np.searchsorted(ends, wanted), len(ends) - 1)
    strand, start = np.divmod(segment, areas.shape[1])
    t = 1.0 - np.clip((ends[segment] - wanted) / np.maximum(areas.ravel()[segment], 1e-30), 0.0, 1.0)
    first, second = strands.points[strand, start], strands.points[strand, start + 1]
    along = second - first
    tangents = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-20)
    sigma_a = strands.absorption(strand, (start + t) / areas.shape[1])
    places = first + along * t[:, None]
    return places, tangents, sigma_a, strands.roughness[strand], strands.fibre[strand], strand


def _cells(places, cell_count):
    """(corner, sides, numbers along X, Y, Z) of cells that fill the box around all places; nearly cubes."""
    low, high = places.min(axis=0).astype(np.float64), places.max(axis=0).astype(np.float64)
    least = 1e-6 * max(float((high - low).max()), 1e-6)
    size = np.maximum(high - low, least)
    cell = max(float(np.prod(size) / cell_count) ** (1.0 / 3.0), float(size.max()) / MOST_CELLS)
    shape = np.maximum(np.ceil(size / (cell * CELLS_A_VOXEL)).astype(int), 1) * CELLS_A_VOXEL
    return low, size / shape, tuple(shape.tolist())


def _fibre_row(settings):
    tilt_trt = 4.0 if settings.shifts == "CYCLES" else 3.0
    scale = float(scale_from_radial_roughness(settings.radial_roughness))
    return settings.eta, scale, settings.tilt, tilt_trt, settings.coat
