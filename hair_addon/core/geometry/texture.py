# SPDX-License-Identifier: GPL-3.0-or-later
"""Images that are mapped onto a surface by UV coordinates."""

from dataclasses import dataclass

import numpy as np

from .mesh import SurfacePoints


@dataclass(frozen=True)
class Texture:
    """An image with values (height, width) float32, bottom row first; corner_uvs: (F, 3, 2) of triangles' corners."""

    values: np.ndarray
    corner_uvs: np.ndarray

    def wound_otherwise(self) -> "Texture":
        """Return the same texture for triangles whose last two corners are swapped."""
        return Texture(self.values, np.ascontiguousarray(self.corner_uvs[:, [0, 2, 1]]))

    def at(self, points: SurfacePoints) -> np.ndarray:
        """Sample the image at `SurfacePoints` → (N,) float64, bilinear between pixel centers, with repetition."""
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
