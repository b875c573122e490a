# SPDX-License-Identifier: GPL-3.0-or-later
"""Check of UV maps: Blender's hair nodes find roots on a moving surface by UV, which is ambiguous where UVs overlap."""

from dataclasses import dataclass

import numpy as np

from ... import geometry
from ..mesh import SurfacePoints, TriMesh, positions


@dataclass(frozen=True)
class Texture:
    """An image with values (height, width) float32, bottom row first; corner_uvs: (F, 3, 2) of triangles' corners."""

    values: np.ndarray
    corner_uvs: np.ndarray

    def with_flipped_winding(self) -> "Texture":
        """Return the same texture for triangles whose last two corners are swapped."""
        return Texture(self.values, np.ascontiguousarray(self.corner_uvs[:, [0, 2, 1]]))

    def at(self, points: SurfacePoints) -> np.ndarray:
        """Return image values (N,) float64 at `SurfacePoints`, bilinear between pixel centers, with repetition."""
        uvs = np.einsum("nc,ncu->nu", points.barycentric, self.corner_uvs[points.triangle].astype(np.float64))
        height, width = self.values.shape
        x, y = uvs[:, 0] * width - 0.5, uvs[:, 1] * height - 0.5
        column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        right, up = x - column, y - row
        lower = (1.0 - right) * self._pixel(row, column) + right * self._pixel(row, column + 1)
        upper = (1.0 - right) * self._pixel(row + 1, column) + right * self._pixel(row + 1, column + 1)
        return (1.0 - up) * lower + up * upper

    def _pixel(self, row, column):
        height, width = self.values.shape
        return self.values[row % height, column % width].astype(np.float64)


_SAMPLE_COUNT = 20_000


def misleading_fraction(mesh: TriMesh, corner_uvs: np.ndarray) -> float:
    """Return the fraction of a checked mesh's area, in [0, 1], whose UV coordinates map to another place.

    corner_uvs: (F, 3, 2). Of two overlapping faces one is counted; faces without UV area are counted.
    """

    roots = geometry.sampling.sample_surface(mesh, _SAMPLE_COUNT, seed=0)
    # The layout as a flat mesh: the closest point on it is the one that a UV maps to.
    flat = np.concatenate([corner_uvs.reshape(-1, 2), np.zeros((3 * len(corner_uvs), 1))], axis=1).astype(np.float32)
    layout = TriMesh(flat, np.arange(len(flat), dtype=np.int32).reshape(-1, 3))
    if not (np.isfinite(flat).all() and np.any(layout.areas > 0.0)):
        return 1.0
    found = geometry.closest_point.SurfaceQuery(layout).nearest(positions(layout, roots))
    apart = np.linalg.norm(positions(mesh, found) - positions(mesh, roots), axis=1)
    # Single precision: a UV layout of side 1 has a resolution of about 1e-7.
    return float(np.mean(apart > 1e-3 * np.ptp(mesh.vertices, axis=0).max()))
