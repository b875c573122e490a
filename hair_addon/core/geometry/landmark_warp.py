# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps of space: affine maps, and thin-plate splines through pairs of landmarks [Bookstein89].

In three dimensions the spline of least bending has the kernel |r|. It is fitted to the residual of the best similarity
[Umeyama91], so that a similarity between landmarks is reproduced exactly.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ..errors import HairError

# Least extent of landmarks, relative to the largest, in a direction that enters the affine map or the rotation.
_DEEP, _WIDE = 0.1, 1e-3


@dataclass(frozen=True)
class Warp:
    """x → A x + b + sum_l w_l |x - c_l|.

    linear: A (3, 3); offset: b (3,) [m]; centers: c (L, 3) [m]; weights: w (L, 3).
    """

    linear: np.ndarray
    offset: np.ndarray
    centers: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    weights: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def places(self, points: np.ndarray) -> np.ndarray:
        """Return the images (N, 3) float64 [m] of points (N, 3) [m]."""
        points = np.asarray(points, np.float64)
        distances = np.linalg.norm(points[:, None] - self.centers, axis=2)
        return points @ self.linear.T + self.offset + distances @ self.weights

    def derivatives(self, points: np.ndarray) -> np.ndarray:
        """Return the Jacobian (N, 3, 3) at points (N, 3) [m]; at a landmark its mean over all directions."""
        apart = np.asarray(points, np.float64)[:, None] - self.centers
        distances = np.linalg.norm(apart, axis=2, keepdims=True)
        directions = apart / np.where(distances > 0.0, distances, 1.0)
        return self.linear + np.einsum("li,nlj->nij", self.weights, directions)


def through_landmarks(sources: ArrayLike, targets: ArrayLike) -> Warp:
    """Return the `Warp` that maps landmarks `sources` (L, 3) [m] to `targets` (L, 3) [m]. Raises `HairError`.

    At least three landmarks that are not collinear are required. The spline reproduces any affine map if there are more
    than three and they are not nearly coplanar, else only similarities.
    """
    sources, targets = (np.asarray(points, np.float64).reshape(-1, 3) for points in (sources, targets))
    if len(sources) != len(targets):
        raise HairError(f"Landmarks come in pairs, not as {len(sources)} and {len(targets)}.")
    if not (np.isfinite(sources).all() and np.isfinite(targets).all()):
        raise HairError("Some landmarks have non-finite coordinates: move them.")
    spreads = [_spread(points) for points in (sources, targets)]
    if len(sources) < 3 or any(spread[1] <= _WIDE * spread[0] for spread in spreads):
        raise HairError("A transfer by landmarks needs three pairs or more that are not in line: add landmarks.")
    if _closest(sources) <= 1e-6 * spreads[0][0]:
        raise HairError("Two landmarks are in the same place: move one of them.")
    linear, offset = similarity(sources, targets)
    left = targets - (sources @ linear.T + offset)
    middle = sources.mean(axis=0)
    is_deep = len(sources) > 3 and spreads[0][2] > _DEEP * spreads[0][0]
    terms = np.column_stack([np.ones(len(sources)), *((sources - middle).T if is_deep else ())])
    kernel = np.linalg.norm(sources[:, None] - sources[None], axis=2)
    count = len(sources)
    system = np.block([[kernel, terms], [terms.T, np.zeros((terms.shape[1], terms.shape[1]))]])
    solved = np.linalg.solve(system, np.concatenate([left, np.zeros((terms.shape[1], 3))]))
    bend = solved[count + 1 :].T if is_deep else np.zeros((3, 3))
    return Warp(linear + bend, offset + solved[count] - bend @ middle, sources, solved[:count])


def similarity(sources: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the scaled rotation (3, 3) and offset (3,) [m] that best map sources (L, 3) to targets [Umeyama91]."""
    middle, other_middle = sources.mean(axis=0), targets.mean(axis=0)
    left, values, right = np.linalg.svd((targets - other_middle).T @ (sources - middle))
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left) * np.linalg.det(right))])
    scale = (values @ signs) / np.sum((sources - middle) ** 2)
    linear = scale * (left * signs) @ right
    return linear, other_middle - linear @ middle


def between_boxes(sources: np.ndarray, targets: np.ndarray) -> Warp:
    """Return the axis-aligned affine `Warp` from the bounding box of vertices (V, 3) [m] to the box of `targets`."""
    low, high = sources.min(axis=0).astype(np.float64), sources.max(axis=0).astype(np.float64)
    other_low, other_high = targets.min(axis=0).astype(np.float64), targets.max(axis=0).astype(np.float64)
    sides, other_sides = high - low, other_high - other_low
    even = other_sides.max() / sides.max() if sides.max() > 0.0 else 1.0
    # A flat box does not determine the scale across it.
    is_thick = (sides > _WIDE * sides.max()) & (other_sides > _WIDE * other_sides.max())
    factors = np.where(is_thick, other_sides / np.where(sides > 0.0, sides, 1.0), even)
    return Warp(np.diag(factors), 0.5 * (other_low + other_high) - 0.5 * factors * (low + high))


def _spread(points):
    """Return the three singular values of points about their mean, in descending order."""
    if len(points) < 2:
        return np.zeros(3)
    values = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return np.concatenate([values, np.zeros(3)])[:3]


def _closest(points):
    """Return the smallest distance [m] between two points."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    return float(apart[~np.eye(len(points), dtype=bool)].min())
