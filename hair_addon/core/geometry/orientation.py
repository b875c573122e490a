# SPDX-License-Identifier: GPL-3.0-or-later
"""Which side of a closed mesh is out."""

import numpy as np

from .mesh import Faces


def is_closed(corner_edges: np.ndarray, edge_count: int) -> bool:
    """Whether each edge of a mesh is between two faces; corner_edges: (C,) int32 of its corners."""
    if len(corner_edges) != 2 * edge_count or edge_count == 0 or corner_edges.min() < 0:
        return False
    return bool((np.bincount(corner_edges, minlength=edge_count) == 2).all())


def signed_volume(vertices: np.ndarray, faces: Faces) -> float:
    """The volume inside a closed mesh, negative where faces are wound to point inward; (V, 3) of any unit."""
    centred = vertices.astype(np.float64) - vertices.mean(axis=0, dtype=np.float64)  # rounding grows with the distance
    corners = faces.corner_vertices
    sizes, firsts, lasts = np.diff(faces.starts), faces.starts[:-1], faces.starts[1:] - 1
    following = np.arange(1, len(corners) + 1)
    following[lasts] = firsts
    across = np.cross(centred[corners], centred[corners[following]])
    apexes = centred[np.repeat(corners[firsts], sizes)]
    return float(np.einsum("cx,cx->", apexes, across)) / 6.0  # the sum of tetrahedra over the origin
