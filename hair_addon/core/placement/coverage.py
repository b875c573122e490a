# SPDX-License-Identifier: GPL-3.0-or-later
"""The area covered by guides, so that hair between a scalp's guides does not grow on the face."""

import numpy as np

from .. import geometry
from ..geometry.mesh import TriMesh

_NEIGHBOURS = 4  # neighbours of a guide, for the guide spacing
_END = 1.3  # times that distance: there is no hair beyond
LEVELS = 8  # of weights above zero: Blender takes those of a vertex group one by one
_WHOLE = 0.95  # of the vertices: more count as all


def coverage(mesh: TriMesh, roots: np.ndarray) -> np.ndarray | None:
    """(V,) float32 in [0, 1] of a checked `TriMesh`: 1 among roots (G, 3) [m], 0 away from them, in `LEVELS`.

    Hair thins out from once to 1.3 times the distance between roots (to the fourth nearest), or the length of
    a vertex' edges where that is more. None where guides are all over, or too few to say.
    """
    import warp as wp  # takes longer to import than the add-on may take to start

    if len(roots) <= _NEIGHBOURS:
        return None
    places, vertices = (wp.array(positions, dtype=wp.vec3, device="cpu") for positions in (roots, mesh.vertices))
    anywhere = 4.0 * float(np.ptp(mesh.vertices, axis=0).max())
    _indices, apart = geometry.hash_grid.neighbours(places, places, anywhere, _NEIGHBOURS + 1)
    nearest, distance = (found.numpy()[:, 0] for found in geometry.hash_grid.neighbours(places, vertices, anywhere, 1))
    reach = np.maximum(apart.numpy()[nearest, -1], _longest_edges(mesh))
    weights = np.clip((_END - distance / np.maximum(reach, 1e-12)) / (_END - 1.0), 0.0, 1.0)
    weights = (np.ceil(weights * LEVELS) / LEVELS).astype(np.float32)
    return None if weights.mean() >= _WHOLE else weights


def _longest_edges(mesh):
    """(V,) [m]: of the triangles around each vertex."""
    longest = np.zeros(len(mesh.vertices))
    for start, end in ((0, 1), (1, 2), (2, 0)):
        lengths = np.linalg.norm(mesh.corners[:, start] - mesh.corners[:, end], axis=1)
        for corner in (start, end):
            np.maximum.at(longest, mesh.triangles[:, corner], lengths)
    return longest
