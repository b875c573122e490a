# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh of polygons with UV coordinates, as arrays."""

from dataclasses import dataclass

import numpy as np

from ..geometry.mesh import Faces


@dataclass(frozen=True)
class PolygonMesh:
    """vertices (V, 3) float32; faces: corners counter-clockwise seen from outside; uvs (corners, 2) float32."""

    vertices: np.ndarray
    faces: Faces
    uvs: np.ndarray

    @property
    def triangle_count(self) -> int:
        """Triangles that the polygons are cut into."""
        return int((np.diff(self.faces.starts) - 2).sum())
