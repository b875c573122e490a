# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of a surface: whole numbers by which hair is kept apart."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Regions:
    """corners (F, 3) int32: the region of each triangle's corners; guides (G,) int32: the guides' own.

    Without the one strands are of the region of their nearest guide, without the other guides are of their roots'.
    """

    corners: np.ndarray | None = None
    guides: np.ndarray | None = None


def regions_at(corners, points):
    """(N,) int32: the region that most of the corners' weight at each `SurfacePoints` is of.

    So the border between two regions of vertices is a straight line through each triangle, halfway along its edges.
    """
    labels = corners[points.triangle]
    shares = np.einsum("nc,ncd->nd", points.barycentric, labels[:, :, None] == labels[:, None, :])
    return np.take_along_axis(labels, shares.argmax(axis=1)[:, None], axis=1)[:, 0]


def kept_apart(regions, roots, guide_roots):
    """(S,) and (G,) int32, alike where all of some `Regions` are; -1 for strands in a region that no guide is in.

    roots, guide_roots: `SurfacePoints`. None for no regions.
    """
    if not regions:
        return None
    of_guides = [regions_at(r.corners, guide_roots) if r.guides is None else r.guides for r in regions]
    of_roots = [
        np.full(len(roots), _NOWHERE) if r.corners is None else regions_at(r.corners, roots).astype(np.int64)
        for r in regions
    ]
    known, labels = np.unique(np.stack(of_guides, axis=1).astype(np.int64), axis=0, return_inverse=True)
    wanted = np.concatenate([known, np.stack(of_roots, axis=1)])
    _all, both = np.unique(wanted, axis=0, return_inverse=True)
    both = both.reshape(-1)
    number_of = np.full(both.max() + 1, -1, np.int32)
    number_of[both[: len(known)]] = np.arange(len(known))
    return number_of[both[len(known) :]], labels.reshape(-1).astype(np.int32)


_NOWHERE = np.int64(2) ** 40  # no attribute of 32 bits holds it
