# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of a surface: whole numbers by which hair is kept apart."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Regions:
    """corners (F, 3) int32: the region of each triangle's corners; guides (G,) int32: the guides' own, or None.

    None: guides are of the region that their roots are in.
    """

    corners: np.ndarray
    guides: np.ndarray | None = None


def regions_at(corners, points):
    """(N,) int32: the region that most of the corners' weight at each `SurfacePoints` is of.

    So the border between two regions of vertices is a straight line through each triangle, halfway along its edges.
    """
    labels = corners[points.triangle]
    shares = np.einsum("nc,ncd->nd", points.barycentric, labels[:, :, None] == labels[:, None, :])
    return np.take_along_axis(labels, shares.argmax(axis=1)[:, None], axis=1)[:, 0]
