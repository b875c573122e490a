# SPDX-License-Identifier: GPL-3.0-or-later
"""Segments of guides with few points, raised until they do not pass through the surface between their points."""

import numpy as np

from ...geometry import mesh as mesh_math
from ...geometry.closest_point import SurfaceQuery
from ...geometry.mesh import TriMesh

_SAMPLES = 24  # places of a guide at which its height is measured, at least one and at most seven of each segment
_PASSES = 24
_OVERSHOOT = 1.02


def raised(mesh: TriMesh, query: SurfaceQuery, points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return guides (S, P, 3) [m], with points moved outward where segments are deeper than a tolerance [m].

    Roots do not move. Guides of two points, which cannot bend, and guides without such a segment do not change.
    """
    found = np.array(points, np.float64)
    segments = found.shape[1] - 1
    if segments < 2:
        return found
    count = int(np.clip(-(-_SAMPLES // segments), 1, 7))
    share = np.arange(1, count + 1) / (count + 1.0)
    rows = np.arange(len(found))
    for _pass in range(_PASSES):
        some = found[rows]
        inner = (1.0 - share[:, None]) * some[:, :-1, None] + share[:, None] * some[:, 1:, None]
        near = query.nearest(inner.reshape(-1, 3))
        normals = mesh_math.normals(mesh, near).astype(np.float64).reshape(inner.shape)
        below = mesh_math.positions(mesh, near).astype(np.float64).reshape(inner.shape)
        depths = np.einsum("spci,spci->spc", below - inner, normals)
        deepest = depths.argmax(axis=2)[..., None]
        depth = np.take_along_axis(depths, deepest, axis=2)[..., 0]
        is_deep = depth > tolerance
        chosen = is_deep.any(axis=1)
        if not chosen.any():
            break
        rows = rows[chosen]
        normal = np.take_along_axis(normals, deepest[..., None], axis=2)[:, :, 0]
        missing = np.where(is_deep, _OVERSHOOT * depth, 0.0)[..., None] * normal
        part = share[deepest]
        whole = (1.0 - part) ** 2 + part**2
        low, high = (1.0 - part) / whole * missing, part / whole * missing
        high[:, 0] = missing[:, 0] / part[:, 0]  # the root stays
        moves = np.zeros(some.shape)
        moves[:, 1:] = high
        is_larger = np.linalg.norm(low[:, 1:], axis=2) > np.linalg.norm(high[:, :-1], axis=2)
        moves[:, 1:-1] = np.where(is_larger[..., None], low[:, 1:], moves[:, 1:-1])
        found[rows] += moves[chosen]
    return found
