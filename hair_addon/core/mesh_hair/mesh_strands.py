# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands of a hair mesh, as arrays."""

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.mesh import SurfacePoints
from ..geometry.strands import curve_offsets


@dataclass(frozen=True)
class MeshStrands:
    """S strands with N points, from root to tip.

    points: (N, 3) float32 [m]; counts: (S,) of points; radii: (N,) float32 [m] with which strands fill their piece;
    places: N `SurfacePoints` on the hair mesh, for its textures; pieces: (S,) piece of each strand; piece_count: number
    of used pieces; skipped_count: number of pieces that are neither cards nor slender, or too large.
    """

    points: np.ndarray
    counts: np.ndarray
    radii: np.ndarray
    places: SurfacePoints
    pieces: np.ndarray
    piece_count: int
    skipped_count: int

    @property
    def starts(self) -> np.ndarray:
        """(S+1,) offsets of each strand's points."""
        return curve_offsets(self.counts)

    def some(self, is_chosen: np.ndarray) -> "MeshStrands":
        """Return the strands with the chosen points; strands with fewer than two are left out; is_chosen: (N,) bool."""
        left = np.add.reduceat(is_chosen.astype(np.int64), self.starts[:-1])
        rows = is_chosen & np.repeat(left >= 2, self.counts)
        return replace(
            self,
            points=self.points[rows],
            counts=left[left >= 2],
            radii=self.radii[rows],
            places=self.places[rows],
            pieces=self.pieces[left >= 2],
        )


def root_to_tip_means(strands: MeshStrands, values: np.ndarray) -> np.ndarray:
    """Return means (S, C) of values (N, C) over the points of each strand."""
    return np.add.reduceat(values, strands.starts[:-1], axis=0) / strands.counts[:, None]
