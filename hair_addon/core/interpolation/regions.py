# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of a surface: integers that separate hair."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.mesh import SurfacePoints


@dataclass(frozen=True)
class Regions:
    """corners (F, 3) int32: the region of each triangle's corners; guides (G,) int32: regions of the guides.

    Without corners, strands belong to the region of their nearest guide; without guides, guides belong to the region at
    their roots.
    """

    corners: np.ndarray | None = None
    guides: np.ndarray | None = None


def regions_at(corners: np.ndarray, points: SurfacePoints) -> np.ndarray:
    """Return (N,) int32: the region with the largest barycentric weight at each of the `SurfacePoints`.

    The border between two regions of vertices is thus a straight line through each triangle, halfway along edges.
    """
    labels = corners[points.triangle]
    shares = np.einsum("nc,ncd->nd", points.barycentric, labels[:, :, None] == labels[:, None, :])
    return np.take_along_axis(labels, shares.argmax(axis=1)[:, None], axis=1)[:, 0]


def _labels(corners, points):
    """Return (N,) int64: `regions_at`, or `_NOWHERE` without corners."""
    return np.full(len(points), _NOWHERE) if corners is None else regions_at(corners, points).astype(np.int64)


def region_labels(
    regions: Sequence[Regions], roots: SurfacePoints, guide_roots: SurfacePoints
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (S,) and (G,) int32, equal where all `Regions` are equal; -1 for strands in a region without guides.

    roots, guide_roots: `SurfacePoints`. None for no regions.
    """
    if not regions:
        return None
    of_guides = [_labels(r.corners, guide_roots) if r.guides is None else r.guides for r in regions]
    of_roots = [_labels(r.corners, roots) for r in regions]
    known, labels = np.unique(np.stack(of_guides, axis=1).astype(np.int64), axis=0, return_inverse=True)
    wanted = np.concatenate([known, np.stack(of_roots, axis=1)])
    _all, both = np.unique(wanted, axis=0, return_inverse=True)
    both = both.reshape(-1)
    number_of = np.full(both.max() + 1, -1, np.int32)
    number_of[both[: len(known)]] = np.arange(len(known))
    return number_of[both[len(known) :]], labels.reshape(-1).astype(np.int32)


_NOWHERE = np.int64(2) ** 40  # outside the range of 32-bit attributes
