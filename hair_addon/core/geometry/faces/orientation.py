# SPDX-License-Identifier: GPL-3.0-or-later
"""Orientation of closed meshes."""

import numpy as np

from ..mesh import Faces


def is_closed(corner_edges: np.ndarray, edge_count: int) -> bool:
    """Return whether each edge of a mesh has two faces; corner_edges: (C,) int32, the edge of each corner."""
    if len(corner_edges) != 2 * edge_count or edge_count == 0 or corner_edges.min() < 0:
        return False
    return bool((np.bincount(corner_edges, minlength=edge_count) == 2).all())


def signed_volume(vertices: np.ndarray, faces: Faces) -> float:
    """Return the volume of a closed mesh, negative if its faces point inward; vertices: (V, 3) of any unit."""
    if len(faces.starts) < 2:
        return 0.0
    # Centered, as rounding grows with the distance from the origin. By columns: np.cross takes five times as long.
    x, y, z = np.ascontiguousarray((vertices.astype(np.float64) - vertices.mean(axis=0, dtype=np.float64)).T)
    here, firsts = faces.corner_vertices, faces.starts[:-1]
    following = np.append(here[1:], here[:1])
    following[faces.starts[1:] - 1] = here[firsts]
    apexes, total = here[firsts], 0.0
    for a, b, c in ((x, y, z), (y, z, x), (z, x, y)):
        across = b[here] * c[following] - c[here] * b[following]
        total += float(a[apexes] @ np.add.reduceat(across, firsts))
    return total / 6.0  # the sum of tetrahedra with an apex at the origin
