# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands: polylines from root to tip.

Warp is imported where an array is created, not at the top: this file is imported while Blender starts.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .. import kernels
from ..errors import HairError
from ..kernels.checks import require_count
from .mesh import SurfacePoints

if TYPE_CHECKING:
    import warp as wp


@dataclass(frozen=True)
class Strands:
    """Strands with points (S, P) vec3 [m], a Warp array on any device, and S roots on the surface.

    points[:, 0] are the positions of the roots; all strands have the same number of points.
    """

    points: "wp.array2d[wp.vec3]"
    roots: SurfacePoints

    def __len__(self) -> int:
        return self.points.shape[0]

    @property
    def point_count(self) -> int:
        """Number of points of each strand."""
        return self.points.shape[1]

    def numpy(self) -> np.ndarray:
        """Return points (S, P, 3) float32 [m]; on the CPU a view."""
        return self.points.numpy()

    def moved(self, points: np.ndarray) -> "Strands":
        """Return the strands with other points (S, P, 3) [m]; on the CPU float32 points are shared, not copied."""
        require_count("strands", len(points), len(self))
        return Strands(_shared(points, self.points.device), self.roots)


def from_numpy(points: ArrayLike, roots: SurfacePoints, device: str = "cpu") -> Strands:
    """Return `Strands` of points (S, P, 3) [m] and S roots; on the CPU float32 points are shared, not copied."""

    shape = np.shape(points)
    if len(shape) != 3 or shape[2] != 3 or shape[0] != len(roots):
        raise ValueError(f"points must be ({len(roots)}, P, 3), not {shape}")
    return Strands(_shared(points, device), roots)


def _shared(points, device):
    wp = kernels.kernel_cache.wp
    return wp.array(np.ascontiguousarray(points, dtype=np.float32), dtype=wp.vec3, device=device, copy=False)


def check_strands(strands: Strands) -> None:
    """Raise `HairError` unless the types, shapes and values of a script's `Strands` are valid.

    `mesh.check_points` checks whether roots are on a mesh.
    """
    import warp as wp

    points, roots = strands.points, strands.roots
    if not (isinstance(points, wp.array) and points.ndim == 2 and points.dtype is wp.vec3):
        raise HairError("Strand points must be a Warp array (S, P) of vec3: create them with strands.from_numpy().")
    wanted = {"triangle": (np.int32, (len(strands),)), "barycentric": (np.float32, (len(strands), 3))}
    for name, (scalar, shape) in wanted.items():
        array = getattr(roots, name, None)
        if not isinstance(array, np.ndarray) or (array.dtype, array.shape) != (scalar, shape):
            kind = f"{np.dtype(scalar)} array of shape {shape}"
            raise HairError(f"Strand roots must be SurfacePoints whose {name} is an {kind}.")
    if 0 in points.shape or not np.isfinite(points.numpy()).all():
        raise HairError("Strands must have points, all with finite coordinates.")


def random_numbers(count: int) -> np.ndarray:
    """Return random numbers (count,) float32 in [0, 1) of strands. A larger count keeps the first numbers."""
    return np.random.Generator(np.random.PCG64(0)).random(count, np.float32)


def offsets(points: np.ndarray) -> np.ndarray:
    """Return offsets (S, P, 3) [m] of points (S, P, 3) [m]: o_0 = p_0, o_i = p_i - p_(i-1)  (Eq. 7)."""
    return np.concatenate([points[:, :1], np.diff(points, axis=1)], axis=1)


def curve_offsets(counts: ArrayLike) -> np.ndarray:
    """Return the starts (C+1,) int64 of curves with counts (C,) of points in a concatenated array, the end included."""
    return np.concatenate([[0], np.cumsum(counts)])


def segment_lengths(points: np.ndarray) -> np.ndarray:
    """Return segment lengths (S, P-1) [m] of points (S, P, 3) [m]."""
    return np.linalg.norm(np.diff(points, axis=1), axis=-1)


def lengths(points: np.ndarray) -> np.ndarray:
    """Return lengths (S,) [m] of strands with points (S, P, 3) [m]."""
    return segment_lengths(points).sum(axis=1)


def ragged_lengths(points: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Return lengths (S,) float64 [m] of ragged polylines; points and starts: see `places_along`."""
    along, starts = _along_all(points), np.asarray(starts, np.int64)
    return along[starts[1:] - 1] - along[starts[:-1]]


def _along_all(points):
    """Return cumulative lengths (N,) float64 at points (N, 3), treated as one polyline."""
    steps = np.diff(np.asarray(points, np.float64), axis=0)
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])


def places_along(points: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Return normalized arc lengths (N,) float32 of the points of ragged polylines, 0 at the root and 1 at the tip.

    points: (N, 3), concatenated; starts: (S+1,) of each polyline, the last entry is N; no polyline may be empty.
    """
    along, starts = _along_all(points), np.asarray(starts, np.int64)
    first, last = along[starts[:-1]], along[starts[1:] - 1]
    spans = np.where(last > first, last - first, 1.0)
    counts = np.diff(starts)
    return ((along - np.repeat(first, counts)) / np.repeat(spans, counts)).astype(np.float32)


def resample_values(values: np.ndarray, points: np.ndarray, starts: np.ndarray, point_count: int) -> np.ndarray:
    """Return values (N,) at the points of ragged polylines, resampled at equal spacing: (S, point_count) float32.

    points: (N, 3), concatenated; starts: (S+1,) of each polyline, the last entry is N; no polyline may be empty.
    """
    starts = np.asarray(starts, np.int64)
    # Polyline i occupies the range [2 i, 2 i + 1].
    places = places_along(points, starts).astype(np.float64) + 2.0 * np.repeat(
        np.arange(len(starts) - 1), np.diff(starts)
    )
    wanted = 2.0 * np.arange(len(starts) - 1)[:, None] + np.linspace(0.0, 1.0, point_count)
    return np.interp(wanted, places, values).astype(np.float32)
