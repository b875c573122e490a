# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a UV map tells where on a surface a root is: Blender's hair nodes find roots on a moving surface by UV."""

import numpy as np

from .mesh import TriMesh, positions

_SAMPLE_COUNT = 20_000


def misleading_share(mesh, corner_uvs):
    """The part of a checked mesh's area, in [0, 1], whose UV coordinates lead to another place of the surface.

    corner_uvs: (F, 3, 2). Where two faces overlap in UV one of them misleads, and a face without an area in UV does.
    """
    from .sampling import sample_surface  # Warp takes longer to import than the add-on may take to start
    from .surface_query import SurfaceQuery

    roots = sample_surface(mesh, _SAMPLE_COUNT, seed=0)
    # The layout as a flat mesh of its own, so that the place that a UV leads to is the nearest point there.
    flat = np.concatenate([corner_uvs.reshape(-1, 2), np.zeros((3 * len(corner_uvs), 1))], axis=1).astype(np.float32)
    layout = TriMesh(flat, np.arange(len(flat), dtype=np.int32).reshape(-1, 3))
    if not (np.isfinite(flat).all() and np.any(layout.areas > 0.0)):
        return 1.0
    found = SurfaceQuery(layout).nearest(positions(layout, roots))
    apart = np.linalg.norm(positions(mesh, found) - positions(mesh, roots), axis=1)
    # Single precision: a UV layout of side 1 resolves some 1e-7 of it.
    return float(np.mean(apart > 1e-3 * np.ptp(mesh.vertices, axis=0).max()))
