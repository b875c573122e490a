# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres inside a surface that keep swinging bones outside the surface."""

import numpy as np

from .. import geometry
from ..geometry.mesh import TriMesh, interpolate

_MOST = 8  # most spheres
_GRID = 14  # places along each axis of the bounding box
_APART = 0.7  # least distance between centers, relative to the larger radius
_LEAST = 0.25  # least radius, relative to the largest sphere


def inner_spheres(surface: TriMesh, joints: np.ndarray, clearance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return centers (K, 3) and radii (K,) of spheres inside a surface, the largest first; K may be zero.

    joints: (N, 3) of bones; clearance: least distance between joints and spheres, so that bones at rest do not move. An
    open surface counts as solid behind its normals.
    """
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    steps = [np.linspace(low[axis], high[axis], _GRID + 2)[1:-1] for axis in range(3)]
    places = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.float32)
    nearest = geometry.closest_point.SurfaceQuery(surface).nearest(places)
    offsets = places - interpolate(surface.vertices, surface, nearest)
    is_inside = (offsets * interpolate(surface.vertex_normals, surface, nearest)).sum(axis=1) < 0.0
    to_joints = np.array([np.linalg.norm(joints - place, axis=1).min() for place in places])
    radii = np.where(is_inside, np.minimum(np.linalg.norm(offsets, axis=1), to_joints - clearance), 0.0)
    chosen = []
    for index in np.argsort(-radii, kind="stable"):
        if len(chosen) == _MOST or radii[index] <= _LEAST * radii[chosen[0] if chosen else index] * (len(chosen) > 0):
            break
        if all(np.linalg.norm(places[index] - places[other]) > _APART * radii[other] for other in chosen):
            chosen.append(index)
    chosen = [index for index in chosen if radii[index] > 0.0]
    return places[chosen].astype(np.float64), radii[chosen].astype(np.float64)
