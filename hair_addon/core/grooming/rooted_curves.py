# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of arbitrary curves to guides: validation, roots and direction."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .. import geometry
from ..errors import HairError
from ..geometry.mesh import SurfacePoints, TriMesh, check_mesh, positions
from ..geometry.strands import curve_offsets
from ..params import Param, array_of, plain_value

# Least difference of the ends' distances to the surface, relative to the curve's size, that determines the direction.
_CLEAR = 0.1
# Distance of roots, relative to the surface's size, beyond which the surface or the unit is probably wrong.
_FAR = 0.02
_EVERY = Param("", low=1)


@dataclass(frozen=True)
class RootedCurves:
    """G of C curves that become guides.

    kept: (G,) ascending indices; is_reversed: (G,) bool, curves from tip to root; roots: G `SurfacePoints` closest to
    the root ends; distances: (G,) [m] to these; is_far: (G,) bool, suspiciously large distances.
    """

    kept: np.ndarray
    is_reversed: np.ndarray
    roots: SurfacePoints
    distances: np.ndarray
    is_far: np.ndarray
    skipped_count: int  # curves of zero length or with non-finite points

    @property
    def reversed_count(self) -> int:
        """Number of curves that run from tip to root."""
        return int(np.count_nonzero(self.is_reversed))

    @property
    def far_count(self) -> int:
        """Number of curves that begin suspiciously far from the surface."""
        return int(np.count_nonzero(self.is_far))

    def point_order(self, starts: np.ndarray) -> np.ndarray:
        """Return indices (M,) of the kept curves' points, each from root to tip; starts (C+1,) as in `root`."""
        counts = np.diff(starts)
        is_kept = np.zeros(len(counts), bool)
        is_kept[self.kept] = True
        return np.flatnonzero(np.repeat(is_kept, counts))[reversal(counts[self.kept], self.is_reversed)]


def reversal(counts: np.ndarray, is_reversed: np.ndarray) -> np.ndarray:
    """Return indices (N,) of the points of curves with counts (C,), in reverse order where is_reversed (C,)."""
    starts = curve_offsets(counts)[:-1]
    place = np.arange(counts.sum()) - np.repeat(starts, counts)
    backwards = np.repeat(counts, counts) - 1 - place
    return np.repeat(starts, counts) + np.where(np.repeat(is_reversed, counts), backwards, place)


def root(
    mesh: TriMesh, points: np.ndarray, starts: np.ndarray, every: int = 1, is_directed: bool = False
) -> RootedCurves:
    """Return the `RootedCurves` of points (N, 3) [m], concatenated over curves, on a `TriMesh`.

    starts (C+1,): of each curve, the last entry is N; every: keep every n-th of the usable curves; is_directed:
    curves run from root to tip, even where the tip is nearer to the mesh. Raises `HairError` if the mesh cannot carry
    hair, no curve is usable, or the median distance of roots exceeds the mesh's size.
    """
    check_mesh(mesh)
    every = checked_every(every)
    points, starts = np.asarray(points, np.float32), np.asarray(starts, np.int64)
    usable = _usable(points, starts)
    if not len(usable):
        raise HairError("No curve can be used: all have zero length or non-finite points.")
    kept = usable[::every]

    ends = points[np.concatenate([starts[:-1][kept], starts[1:][kept] - 1])]
    reach = float(np.abs(ends).max())
    if reach > 0.1 * geometry.closest_point.FARTHEST:
        raise HairError("The curves extend {distance:g} m from the origin: check their units.", distance=reach)
    found = geometry.closest_point.SurfaceQuery(mesh).nearest(ends)
    distances = np.linalg.norm(positions(mesh, found) - ends, axis=1)
    at_first, at_last = distances[: len(kept)], distances[len(kept) :]
    is_reversed = np.zeros(len(kept), bool)
    if not is_directed:
        is_reversed = _run_backwards(at_first, at_last, _sizes(points, starts)[kept])
    chosen = np.arange(len(kept)) + np.where(is_reversed, len(kept), 0)
    distances = distances[chosen]
    size = float(np.ptp(mesh.vertices, axis=0).max())
    distance = float(np.median(distances))
    if distance > size:
        raise HairError(
            "Roots lie {distance:.3g} m from the surface, which is {size:.3g} m large: check unit and axis.",
            distance=distance,
            size=size,
        )
    is_far = distances > _FAR * size
    return RootedCurves(kept, is_reversed, found[chosen], distances, is_far, len(starts) - 1 - len(usable))


def checked_every(every: int) -> int:
    """Return `every` as an int of at least 1. Raises `HairError`."""
    return plain_value("Keep Every", every, 1, _EVERY)


def _usable(points, starts):
    """Return indices of the curves with positive length and finite points."""
    counts = np.diff(starts)
    is_usable = counts >= 2
    if not is_usable.any():
        return np.flatnonzero(is_usable)
    is_finite = np.isfinite(points).all(axis=1)
    bad = np.zeros(len(counts), np.int64)
    np.add.at(bad, np.repeat(np.arange(len(counts)), counts)[~is_finite], 1)
    is_usable &= bad == 0
    is_usable[is_usable] = _sizes(points, starts)[is_usable] > 0.0
    return np.flatnonzero(is_usable)


def _sizes(points, starts):
    """Return the longest side (C,) [m] of each curve's bounding box; NaN for NaN points, 0 without points."""
    sizes = np.zeros(len(starts) - 1, np.float32)
    has_points = np.diff(starts) > 0
    first = starts[:-1][has_points]
    with np.errstate(invalid="ignore"):
        high, low = (extreme.reduceat(points, first, axis=0) for extreme in (np.maximum, np.minimum))
        sizes[has_points] = (high - low).max(axis=1)
    return sizes


def _run_backwards(at_first, at_last, sizes):
    """Return (G,) bool: whether the last point is the root. Ambiguous curves follow the majority of the others."""
    margin = _CLEAR * sizes
    is_backwards, is_forwards = at_last < at_first - margin, at_first < at_last - margin
    backwards_count, forwards_count = np.count_nonzero(is_backwards), np.count_nonzero(is_forwards)
    if backwards_count > forwards_count:
        return ~is_forwards
    return is_backwards


def polylines(curves: Iterable[ArrayLike]) -> tuple[np.ndarray, np.ndarray]:
    """Return (points (N, 3) float32, starts (C+1,)) of concatenated arrays (P, 3). Raises `HairError`."""
    try:
        lines = [array_of(line, np.float32) for line in curves]
    except (TypeError, ValueError, OverflowError):  # not iterable
        lines = []
    usable = [line for line in lines if line is not None and line.ndim == 2 and line.shape[1] == 3]
    if not usable or len(usable) < len(lines):
        raise HairError("Curves must be a non-empty sequence of arrays (P, 3), one per curve.")
    return np.concatenate(usable), curve_offsets([len(line) for line in usable])
