# SPDX-License-Identifier: GPL-3.0-or-later
"""UV map check: Blender's hair nodes find roots on a moving surface by UV, which is ambiguous where UVs overlap."""

import numpy as np

from .. import geometry
from .mesh import TriMesh, positions

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
