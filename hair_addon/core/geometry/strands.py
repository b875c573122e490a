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
    """points (S, P) vec3 [m], a Warp array on the device that the strands live on, and the S roots on the surface.

    points[:, 0] are the roots' positions; every strand has the same number of points.
    """

    points: "wp.array2d[wp.vec3]"
    roots: SurfacePoints

    def __len__(self) -> int:
        return self.points.shape[0]

    @property
    def point_count(self) -> int:
        """Points per strand."""
        return self.points.shape[1]

    def numpy(self) -> np.ndarray:
        """(S, P, 3) float32 [m]; on the CPU a view that shares the strands' memory."""
        return self.points.numpy()

    def moved(self, points: np.ndarray) -> "Strands":
        """The same strands where they have points (S, P, 3) [m] now; on the CPU float32 points are shared."""
        require_count("strands", len(points), len(self))
        return Strands(_shared(points, self.points.device), self.roots)


def from_numpy(points: ArrayLike, roots: SurfacePoints, device: str = "cpu") -> Strands:
    """Points (S, P, 3) [m] and their S roots → `Strands`; on the CPU float32 points are shared, not copied."""

    shape = np.shape(points)
    if len(shape) != 3 or shape[2] != 3 or shape[0] != len(roots):
        raise ValueError(f"points must be ({len(roots)}, P, 3), not {shape}")
    return Strands(_shared(points, device), roots)


def _shared(points, device):
    wp = kernels.kernel_cache.wp
    return wp.array(np.ascontiguousarray(points, dtype=np.float32), dtype=wp.vec3, device=device, copy=False)


def check_strands(strands: Strands) -> None:
    """Raise `HairError` unless the types, shapes and values of `Strands` are valid. For those of scripts.

    Whether their roots are on a mesh is for `mesh.check_points`.
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
    """(count,) random numbers, float32 in [0, 1), of strands. A larger count does not change the first ones."""
    return np.random.Generator(np.random.PCG64(0)).random(count, np.float32)


def offsets(points: np.ndarray) -> np.ndarray:
    """(S, P, 3) [m] → o (S, P, 3) [m]: o_0 = p_0, o_i = p_i - p_(i-1)  (Eq. 7)."""
    return np.concatenate([points[:, :1], np.diff(points, axis=1)], axis=1)


def curve_offsets(counts: ArrayLike) -> np.ndarray:
    """(C,) point counts → (C+1,) int64: where each curve's points begin in one array of all, and where that ends."""
    return np.concatenate([[0], np.cumsum(counts)])


def segment_lengths(points: np.ndarray) -> np.ndarray:
    """(S, P, 3) [m] → (S, P-1) [m]."""
    return np.linalg.norm(np.diff(points, axis=1), axis=-1)


def lengths(points: np.ndarray) -> np.ndarray:
    """(S, P, 3) [m] → (S,) [m], from root to tip."""
    return segment_lengths(points).sum(axis=1)


def ragged_lengths(points: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """(S,) float64 [m], from root to tip of ragged polylines; points and starts as of `places_along`."""
    along, starts = _along_all(points), np.asarray(starts, np.int64)
    return along[starts[1:] - 1] - along[starts[:-1]]


def _along_all(points):
    """(N,) float64: the length from the first of (N, 3) points to each, as if all were one polyline."""
    steps = np.diff(np.asarray(points, np.float64), axis=0)
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])


def places_along(points: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """(N,) float32: where each point of ragged polylines is along its own, 0 at its root and 1 at its tip.

    points (N, 3) and starts (S+1,) as of `resample`; every polyline has points.
    """
    along, starts = _along_all(points), np.asarray(starts, np.int64)
    first, last = along[starts[:-1]], along[starts[1:] - 1]
    spans = np.where(last > first, last - first, 1.0)
    counts = np.diff(starts)
    return ((along - np.repeat(first, counts)) / np.repeat(spans, counts)).astype(np.float32)


def resample_values(values: np.ndarray, points: np.ndarray, starts: np.ndarray, point_count: int) -> np.ndarray:
    """Values (N,) at the points of ragged polylines → (S, point_count) float32, equally spaced along each.

    points (N, 3) and starts (S+1,) as of `resample`; every polyline has points.
    """
    starts = np.asarray(starts, np.int64)
    # Polylines one behind the other, each two long.
    places = places_along(points, starts).astype(np.float64) + 2.0 * np.repeat(
        np.arange(len(starts) - 1), np.diff(starts)
    )
    wanted = 2.0 * np.arange(len(starts) - 1)[:, None] + np.linspace(0.0, 1.0, point_count)
    return np.interp(wanted, places, values).astype(np.float32)


def resample(points: np.ndarray, starts: np.ndarray, point_count: int) -> np.ndarray:
    """Ragged polylines → (S, point_count, 3) float32 [m], equally spaced along each, ends kept.

    points (N, 3) holds all polylines one after the other and starts (S+1,) says where each begins, the last entry
    being N (Blender's `curve_offset_data`). A polyline of one point, or of no length, becomes that point repeated.
    """
    points = np.asarray(points, dtype=np.float64)
    starts = np.asarray(starts, dtype=np.int64)
    counts = np.diff(starts)
    if len(starts) < 1 or starts[0] != 0 or starts[-1] != len(points) or np.any(counts < 0):
        raise ValueError("starts must rise from 0 to the number of points")
    if np.any(counts == 0):
        raise HairError("{count} curves have no points: delete them.", count=np.count_nonzero(counts == 0))
    if not np.isfinite(points).all():
        raise HairError("Some points of the curves have non-finite coordinates: delete those curves.")
    if len(counts) == 0:
        return np.empty((0, point_count, 3), np.float32)
    # One running length over all polylines and the jumps between them, which no segment below is.
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    first, last = starts[:-1], starts[1:] - 1
    wanted = along[first, None] + np.linspace(0.0, 1.0, point_count) * (along[last] - along[first])[:, None]
    # The segment that holds each wanted length, kept inside its own polyline.
    segment = np.searchsorted(along, wanted.ravel(), side="right").reshape(wanted.shape) - 1
    segment = np.clip(segment, first[:, None], np.maximum(last - 1, first)[:, None])
    ahead = np.minimum(segment + 1, last[:, None])
    span = along[ahead] - along[segment]
    fraction = np.clip((wanted - along[segment]) / np.where(span > 0.0, span, 1.0), 0.0, 1.0)[..., None]
    resampled = (1.0 - fraction) * points[segment] + fraction * points[ahead]
    resampled[:, 0], resampled[:, -1] = points[first], points[last]
    return resampled.astype(np.float32)
