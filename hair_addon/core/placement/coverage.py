# SPDX-License-Identifier: GPL-3.0-or-later
"""The area covered by guides. Outside this area no hair grows, for example on the face beside a scalp's guides."""

import numpy as np

from .. import geometry
from ..geometry.mesh import TriMesh

_NEIGHBOURS = 4  # neighbors of a guide that define the guide spacing
_END = 1.3  # limit of hair, in guide spacings
LEVELS = 8  # number of positive weights: Blender assigns each weight of a vertex group by a separate call
_WHOLE = 0.95  # mean weight above which the whole mesh counts as covered


def coverage(mesh: TriMesh, roots: np.ndarray) -> np.ndarray | None:
    """Return weights (V,) float32 of a checked `TriMesh`: 1 near roots (G, 3) [m], 0 away from them, in `LEVELS` steps.

    Hair thins out between 1 and 1.3 times the guide spacing (distance to the fourth nearest root), or the longest edge
    at a vertex if that is larger. None if guides cover the mesh or are too few.
    """
    import warp as wp  # slow to import: the add-on must start without it

    if len(roots) <= _NEIGHBOURS:
        return None
    places, vertices = (wp.array(positions, dtype=wp.vec3, device="cpu") for positions in (roots, mesh.vertices))
    anywhere = 4.0 * float(np.ptp(mesh.vertices, axis=0).max())
    _indices, apart = geometry.search.hash_grid.neighbours(places, places, anywhere, _NEIGHBOURS + 1)
    nearest, distance = (
        found.numpy()[:, 0] for found in geometry.search.hash_grid.neighbours(places, vertices, anywhere, 1)
    )
    reach = np.maximum(apart.numpy()[nearest, -1], _longest_edges(mesh))
    weights = np.clip((_END - distance / np.maximum(reach, 1e-12)) / (_END - 1.0), 0.0, 1.0)
    weights = (np.ceil(weights * LEVELS) / LEVELS).astype(np.float32)
    return None if weights.mean() >= _WHOLE else weights


def _longest_edges(mesh):
    """Return the longest edge (V,) [m] of the triangles around each vertex."""
    longest = np.zeros(len(mesh.vertices))
    for start, end in ((0, 1), (1, 2), (2, 0)):
        lengths = np.linalg.norm(mesh.corners[:, start] - mesh.corners[:, end], axis=1)
        for corner in (start, end):
            np.maximum.at(longest, mesh.triangles[:, corner], lengths)
    return longest
