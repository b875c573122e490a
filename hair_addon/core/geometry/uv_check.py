# SPDX-License-Identifier: GPL-3.0-or-later
"""UV map check: Blender's hair nodes find roots on a moving surface by UV, which overlaps make ambiguous."""

import numpy as np

from .. import geometry
from .mesh import TriMesh, positions

_SAMPLE_COUNT = 20_000


def misleading_fraction(mesh: TriMesh, corner_uvs: np.ndarray) -> float:
    """The part of a checked mesh's area, in [0, 1], whose UV coordinates lead to another place of the surface.

    corner_uvs: (F, 3, 2). Of two faces that overlap in UV one is counted, and so is a face without area in UV.
    """

    roots = geometry.sampling.sample_surface(mesh, _SAMPLE_COUNT, seed=0)
    # The layout as a flat mesh, on which the nearest point is the one that a UV maps to.
    flat = np.concatenate([corner_uvs.reshape(-1, 2), np.zeros((3 * len(corner_uvs), 1))], axis=1).astype(np.float32)
    layout = TriMesh(flat, np.arange(len(flat), dtype=np.int32).reshape(-1, 3))
    if not (np.isfinite(flat).all() and np.any(layout.areas > 0.0)):
        return 1.0
    found = geometry.closest_point.SurfaceQuery(layout).nearest(positions(layout, roots))
    apart = np.linalg.norm(positions(mesh, found) - positions(mesh, roots), axis=1)
    # Single precision: a UV layout of side 1 resolves some 1e-7 of it.
    return float(np.mean(apart > 1e-3 * np.ptp(mesh.vertices, axis=0).max()))
