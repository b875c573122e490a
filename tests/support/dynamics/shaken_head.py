# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides that lie on the sample head, and a shake of the head."""

import numpy as np

from hair_addon.core.dynamics.rod import rotations
from hair_addon.core.dynamics.root_motion import RigidMotion

FRAME = 1.0 / 24.0  # [s]
NECK = np.array([0.0, -0.04, 0.72])


def grown(mesh, count=96, length=0.2):
    """Return (count, 41, 3): straight guides from the upper part of the head, outward and a little down."""
    rng = np.random.default_rng(0)
    corners = mesh.corners.astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    back = np.clip((corners[..., 1].mean(axis=1) + 0.08) / 0.08, 0.0, 1.0)  # of the head: there hair grows lower
    is_scalp = corners[..., 2].min(axis=1) > 0.80 - 0.10 * back
    faces = rng.choice(np.flatnonzero(is_scalp), count, p=(sizes / sizes[is_scalp].sum())[is_scalp])
    roots = np.einsum("gk,gki->gi", rng.dirichlet(np.ones(3), count), corners[faces])
    ways = normals[faces] / sizes[faces, None] - [0.0, 0.0, 0.3]
    return roots[:, None] + length * np.linspace(0.0, 1.0, 41)[:, None] * rotations.unit(ways)[:, None]


def shake(frame):
    """Return the motion of 70° to either side at 1.5 Hz, 660°/s, and 5 cm at 3 Hz."""
    half = 0.5 * np.radians(70.0) * np.sin(3.0 * np.pi * frame * FRAME)
    way = np.array([0.05 * np.sin(6.0 * np.pi * frame * FRAME), 0.0, 0.0])
    return RigidMotion(np.array([0.0, 0.0, np.sin(half), np.cos(half)]), NECK, way)
