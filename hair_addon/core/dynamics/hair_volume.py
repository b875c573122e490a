# SPDX-License-Identifier: GPL-3.0-or-later
"""Interaction of hair: friction, pressure and cohesion of all strands as a volume on a grid [Petrovic06] [McAdams09].

Each region of the surface has its own grid, so that hair on both sides of a parting does not mix. Sums over points are
integers, and thus bit-identical for any order and number of cores.

    ρ_c = Σ w m,  P_c = Σ w m v                                   trilinear weights w; ρ⁰ of the groom
    v_i ← (1 - f) v_i + f Σ w P_c / ρ_c,  f = 1 - exp(-k_f Δt)    friction: preserves momentum
    e_c = (ρ_c - 1.2 max(ρ⁰_c, ρ̄, ρ¹))₊                          pressure: excess of density
    s_c = min(0.8 ρ⁰_c - ρ_c, 3 ρ_c)₊                             cohesion: lack of density, zero if torn apart
    v_i ← v_i - Δt (k_p / ρ̄) Σ_c (e_c - wetness_i s_c) ∇w_ic      |Δv| ≤ ½ cell / Δt

ρ̄ is the mean of ρ⁰ over its non-empty cells. Without ρ̄ in the pressure, hair could not fall into places without hair
in the groom. ρ¹ is the largest density of a single straight strand in a cell: without ρ¹, isolated strands would repel
themselves.

Hair at rest stays at rest. Where an explicit step would overshoot because hair is too dense, e and s are reduced so
that (ω Δt)² = 2 k_p ρ_c / ρ̄ (Δt / cell)² stays below 1. ∇w is discontinuous between cells, so a point between opposite
pushes moves to the border of the cells (hair_cells.py).
"""

import math
from typing import Any

import numpy as np
import warp as wp

from ..errors import HairError
from ..kernels import kernel_cache, native_code, parallel
from ..kernels.checks import require_count, require_indices
from .hair_cells import Grid, cell_of, part_of, rubbed

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

LEAST_CELL = 0.004  # [m]
MOST_CELLS_ALONG = 96
MOST_CELLS = 4 * MOST_CELLS_ALONG**3  # cells of all regions together

_FEWEST_CELLS = 4096  # number of cells of a region that is always allowed
_MOST_SHARES = 4  # shares of the points, each with its own grid for sums
_LEAST_ROWS = 20_000  # least number of points for a thread
_UNIT = wp.constant(2.0**20)  # units of sums per mean mass
_FASTEST = wp.constant(1.0e4)  # [m/s]: faster points are ignored
_FARTHEST = wp.constant(1.0e5)  # [m]
_DENSE, _THIN, _LOOSE = wp.constant(1.2), wp.constant(0.8), wp.constant(3.0)


class HairVolume:
    """The volume of strands whose points have masses (groups, points, lanes), in units of the mean mass.

    Points of zero mass, such as those of unused lanes, are ignored. Positions and velocities are (groups, points × 3,
    lanes), as in the solver.
    """

    def __init__(self, masses: Any, regions: np.ndarray | None = None, cell_size: float = LEAST_CELL) -> None:
        """regions: (groups, lanes) integers from 0, the region of each strand; cell_size: least size [m]."""
        self.device = masses.device
        self._shape = groups, _, lanes = masses.shape
        self._masses = masses
        regions = np.zeros((groups, lanes), np.int32) if regions is None else np.asarray(regions, np.int32)
        require_count("groups", regions.shape[0], groups)
        require_count("lanes", regions.shape[1], lanes)
        self._region_count = int(regions.max(initial=0)) + 1
        require_indices("regions", regions, self._region_count)
        if self._region_count * 64 > MOST_CELLS:
            raise HairError("There are too many regions for hair to have a volume.")
        if not (math.isfinite(cell_size) and cell_size > 0.0):
            raise HairError("The cell size must be positive, not {size} m.", size=cell_size)
        self._regions = wp.array(regions, dtype=int, device=self.device)
        # A grid with many more cells than points would be mostly empty, and slower to clear than to fill.
        self._most_cells = min(max(2 * math.prod(masses.shape), _FEWEST_CELLS * self._region_count), MOST_CELLS)
        self._least_cell = cell_size
        self.cell_size = cell_size
        self.grid: Any = None
        self._rest: Any = None
        self._mean: Any = None
        self._alone = 0.0  # ρ¹
        self._weights: Any = None
        self._kept_sums: list[Any] = []
        self._fields: Any = None
        self._missing: Any = None  # s / ρ̄ of each cell; empty if all strands are dry

    def fit(self, positions: Any, groom: Any) -> None:
        """Fit the grid to strands and to the groom, moved with the surface [m]; call this once per frame."""
        self._require_shape(positions)
        self._require_shape(groom)
        bounds = wp.array(np.repeat([[np.inf], [-np.inf]], 3, axis=1), dtype=float, device=self.device)
        for points in (positions, groom):
            inputs = [self._masses, points]
            kernel_cache.launch(_bound, self._shape, inputs=inputs, outputs=[bounds], device=self.device)
        low, high = bounds.numpy().astype(np.float64)
        if not np.isfinite([low, high]).all():
            self.grid = None
            return
        self.cell_size, first, counts = self._cells(low, high)
        self.grid = Grid()
        self.grid.low, self.grid.counts = wp.vec3i(*map(int, first)), wp.vec3i(*map(int, counts))
        self.grid.per_cell = 1.0 / self.cell_size
        self._rest = self._sums(groom, None)
        self._alone = self._single_strand_mass(groom)
        self._mean = wp.zeros(2, dtype=wp.int64, device=self.device)
        kernel_cache.launch(_average, len(self._rest), inputs=[self._rest], outputs=[self._mean], device=self.device)

    def rub(
        self, positions: Any, velocities: Any, duration: float, friction: float, pressure: float, wetness: Any = None
    ) -> None:
        """Apply the interaction of hair to velocities [m/s] for a duration [s]; roots are not changed.

        friction k_f [1/s]; pressure k_p [m²/s²]; wetness (groups, 1, lanes) of each strand in [0, 1], None if all are
        dry. Requires `fit` in this frame; points that have left the grid since are not changed.
        """
        self._require_shape(positions)
        self._require_shape(velocities)
        values = duration, friction, pressure
        if self.grid is None or not all(map(math.isfinite, values)) or not duration > 0.0:
            return
        wetness = wp.zeros((0, 0, 0), dtype=float, device=self.device) if wetness is None else wetness
        sums = self._sums(positions, velocities)
        mixed = -math.expm1(-max(friction, 0.0) * duration)
        groups, points, lanes = self._shape
        if wetness.size:
            for name, count, wanted in zip(("groups", "rows", "lanes"), wetness.shape, (groups, 1, lanes), strict=True):
                require_count(name, count, wanted)
        fields, missing = self._fields, self._missing_of(len(sums) if wetness.size else 0)
        shares = parallel.share_count(len(sums), self.device, _LEAST_ROWS)
        stiffness = 2.0 * max(pressure, 0.0) * (duration / self.cell_size) ** 2
        inputs = [sums, self._rest, self._mean, self._alone, stiffness]
        parallel.launch_shares(_mean_motion, len(sums), inputs, [[fields, missing]] * shares, self.device)
        inputs = [self.grid, self._masses, self._regions, wetness, positions, fields, missing]
        inputs += [mixed, duration, duration * pressure / self.cell_size, 0.5 * self.cell_size / duration]
        kernel_cache.load(self.device, _rub.module)
        shares = parallel.share_count(groups * points * lanes, self.device, _LEAST_ROWS // 8)
        parallel.launch_shares(_rub, groups * points * lanes, inputs, [[velocities]] * shares, self.device)

    def _missing_of(self, cell_count):
        """Return the array of s / ρ̄ for a number of cells."""
        if self._missing is None or len(self._missing) != cell_count:
            self._missing = wp.empty(cell_count, dtype=float, device=self.device)
        return self._missing

    def _single_strand_mass(self, groom):
        """Return ρ¹, the largest mass of a straight mean strand in a cell.

        This is the mass of a point, or of all points within the length of a cell.
        """
        if self._weights is None:
            masses = self._masses.numpy().astype(np.float64)
            points = groom.numpy().astype(np.float64).reshape(len(masses), -1, 3, masses.shape[2])
            lengths = np.linalg.norm(np.diff(points, axis=1), axis=2).mean(axis=1)
            is_strand = (masses > 0.0).any(axis=1) & (lengths > 0.0)
            self._weights = masses.mean(axis=1)[is_strand], lengths[is_strand]
        masses, lengths = self._weights
        if not len(masses):
            return 0.0
        return float(_UNIT * (masses * np.maximum(1.0, self.cell_size / lengths)).mean())

    def _cells(self, low, high):
        """Return (cell size, first cell, number of cells along each axis) of a grid over a box, with a margin."""
        size = self._least_cell
        while True:
            first = np.floor(low / size) - 1.0
            counts = np.floor(high / size) + 3.0 - first
            if counts.max() <= MOST_CELLS_ALONG and counts.prod() * self._region_count <= self._most_cells:
                return size, first, counts
            size *= 1.25

    def _sums(self, positions, velocities):
        """Return sums (cells, 4) int64: mass and momentum of each cell, or mass alone (cells, 1) without velocities."""
        groups, points, lanes = self._shape
        cell_count = self._region_count * math.prod(self.grid.counts)
        count = groups * points * lanes
        shares = min(_MOST_SHARES, parallel.share_count(count, self.device, _LEAST_ROWS))
        width = 1 if velocities is None else 4
        sums = self._cleared(cell_count, width, shares)
        inputs = [self.grid, self._masses, self._regions, positions, positions if velocities is None else velocities]
        kernel_cache.load(self.device, _scatter.module)
        parallel.launch_shares(_scatter, count, inputs, [[each] for each in sums], self.device)
        for other in sums[1:]:  # on the CPU, where each thread has its own sums
            total = sums[0].numpy()
            total += other.numpy()
        return sums[0]

    def _cleared(self, cell_count, width, shares):
        """Return arrays of zeros; arrays for motion are reused, because allocation takes as long as a sum."""
        if width == 1:
            return [wp.zeros((cell_count, width), dtype=wp.int64, device=self.device) for _ in range(shares)]
        if len(self._kept_sums) != shares or len(self._kept_sums[0]) != cell_count:
            shape = cell_count, width
            self._kept_sums = [wp.empty(shape, dtype=wp.int64, device=self.device) for _ in range(shares)]
            self._fields = wp.empty(cell_count, dtype=wp.vec4, device=self.device)
        for sums in self._kept_sums:
            sums.zero_()
        return self._kept_sums

    def _require_shape(self, array):
        groups, points, lanes = self._shape
        wanted_shape = groups, 3 * points, lanes
        for name, count, wanted in zip(("groups", "rows", "lanes"), array.shape, wanted_shape, strict=True):
            require_count(name, count, wanted)


@wp.func
def _vector(values: wp.array3d[float], group: int, point: int, lane: int):
    x = values[group, 3 * point, lane]
    y = values[group, 3 * point + 1, lane]
    return wp.vec3(x, y, values[group, 3 * point + 2, lane])


@wp.func
def _is_near(position: wp.vec3):
    return wp.isfinite(wp.length(position)) and wp.max(wp.abs(position)) < _FARTHEST


@wp.func_native(native_code.body(__file__, "hair_sums.cpp"))
def _add(
    row: int, across: int, along: int, part: wp.vec3, mass: float, velocity: wp.vec3, sums: wp.array2d[wp.int64]
): ...


@wp.kernel
def _bound(
    masses: wp.array3d[float],
    positions: wp.array3d[float],
    # outputs
    bounds: wp.array2d[float],
):
    group, point, lane = wp.tid()
    position = _vector(positions, group, point, lane)
    if masses[group, point, lane] > 0.0 and _is_near(position):
        for axis in range(3):
            wp.atomic_min(bounds, 0, axis, position[axis])
            wp.atomic_max(bounds, 1, axis, position[axis])


@wp.kernel
def _scatter(
    grid: Grid,
    masses: wp.array3d[float],
    regions: wp.array2d[int],
    positions: wp.array3d[float],
    velocities: wp.array3d[float],
    first: int,
    # outputs
    out_sums: wp.array2d[wp.int64],
):
    thread = first + wp.tid()
    lane_count = masses.shape[2]
    lane = thread % lane_count
    point = (thread // lane_count) % masses.shape[1]
    group = thread // (lane_count * masses.shape[1])
    mass = masses[group, point, lane]
    place = grid.per_cell * _vector(positions, group, point, lane)
    velocity = _vector(velocities, group, point, lane)
    with_momentum = out_sums.shape[1] > 1
    if not (mass > 0.0 and _is_near(place)):
        return
    if with_momentum and not wp.length(velocity) < _FASTEST:
        return
    cell = cell_of(grid, place, regions[group, lane])
    if cell < 0:
        return
    _add(cell, grid.counts[1] * grid.counts[2], grid.counts[2], part_of(place), mass * _UNIT, velocity, out_sums)


@wp.kernel
def _average(
    sums: wp.array2d[wp.int64],
    # outputs
    out_mean: wp.array[wp.int64],
):
    cell = wp.tid()
    if sums[cell, 0] > wp.int64(0):
        wp.atomic_add(out_mean, 0, sums[cell, 0])
        wp.atomic_add(out_mean, 1, wp.int64(1))


@wp.kernel
def _mean_motion(
    sums: wp.array2d[wp.int64],
    rest: wp.array2d[wp.int64],
    mean: wp.array[wp.int64],
    alone: float,
    stiffness: float,
    first: int,
    # outputs
    out_fields: wp.array[wp.vec4],
    out_missing: wp.array[float],
):
    cell = first + wp.tid()
    is_wet = out_missing.shape[0] > 0
    out_fields[cell] = wp.vec4()
    if is_wet:
        out_missing[cell] = 0.0
    if sums[cell, 0] == wp.int64(0):
        return
    scale = 1.0
    if mean[0] > wp.int64(0):
        scale = float(mean[1]) / float(mean[0])
    density = float(sums[cell, 0])
    at_rest = float(rest[cell, 0])
    excess = wp.max(density - _DENSE * wp.max(wp.max(at_rest, alone), 1.0 / scale), 0.0)
    counted = scale / wp.max(stiffness * scale * density, 1.0)
    share = 1.0 / density
    x = share * float(sums[cell, 1])
    y = share * float(sums[cell, 2])
    out_fields[cell] = wp.vec4(x, y, share * float(sums[cell, 3]), counted * excess)
    if is_wet:
        out_missing[cell] = counted * wp.max(wp.min(_THIN * at_rest - density, _LOOSE * density), 0.0)


@wp.kernel
def _rub(
    grid: Grid,
    masses: wp.array3d[float],
    regions: wp.array2d[int],
    wetness: wp.array3d[float],
    positions: wp.array3d[float],
    fields: wp.array[wp.vec4],
    missing: wp.array[float],
    mixed: float,
    duration: float,
    pressure: float,
    fastest: float,
    first: int,
    # outputs
    velocities: wp.array3d[float],
):
    thread = first + wp.tid()
    lane_count = masses.shape[2]
    lane = thread % lane_count
    point = (thread // lane_count) % masses.shape[1]
    group = thread // (lane_count * masses.shape[1])
    place = grid.per_cell * _vector(positions, group, point, lane)
    velocity = _vector(velocities, group, point, lane)
    if point == 0 or not (masses[group, point, lane] > 0.0 and _is_near(place)):
        return
    if not wp.length(velocity) < _FASTEST:
        return
    wet = 0.0
    if wetness.shape[0] > 0:
        wet = wetness[group, 0, lane]
    region = regions[group, lane]
    velocity = rubbed(grid, region, place, velocity, wet, fields, missing, mixed, duration, pressure, fastest)
    for axis in range(3):
        velocities[group, 3 * point + axis, lane] = velocity[axis]
