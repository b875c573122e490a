# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh of polygons with UV coordinates, as arrays."""

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.mesh import Faces


@dataclass(frozen=True)
class PolygonMesh:
    """vertices (V, 3) float32; faces: corners counter-clockwise seen from outside; uvs (corners, 2) float32.

    colors: linear RGB (V, 3) float32 of vertices, None for the color of the material.
    """

    vertices: np.ndarray
    faces: Faces
    uvs: np.ndarray
    colors: np.ndarray | None = None

    def transformed(self, axes: np.ndarray) -> "PolygonMesh":
        """Return the mesh transformed by axes (3, 3); faces are flipped if the axes mirror."""
        vertices = (self.vertices @ axes.T).astype(np.float32)
        if np.linalg.det(axes) > 0.0:
            return replace(self, vertices=vertices)
        starts = self.faces.starts
        # From the last corner of each face to its first.
        ends = np.repeat(starts[:-1] + starts[1:] - 1, np.diff(starts))
        order = ends - np.arange(len(self.faces.corner_vertices))
        faces = Faces(np.ascontiguousarray(self.faces.corner_vertices[order]), starts)
        return PolygonMesh(vertices, faces, np.ascontiguousarray(self.uvs[order]), self.colors)

    @property
    def triangle_count(self) -> int:
        """Number of triangles after triangulation."""
        return int((np.diff(self.faces.starts) - 2).sum())
