# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient cube: radiance of six sides, interpolated by direction.

The weights of a direction's three sides are its squared cosines, which sum to one.
"""

from itertools import product

import numpy as np


def _turned(quaternion):
    """Return the rotation (3, 3) of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


# Faces and corners of a cube: the quadrature with these weights is exact for polynomials of degree 5 [Lebedev76].
_FACES = np.concatenate([np.eye(3), -np.eye(3)])
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3))) / np.sqrt(3.0)
# Directions are rotated: otherwise four directions would lie in the plane of a level surface, and the surface would
# occlude 0.37 of the weight.
_QUATERNION = np.array([3.0, 1.0, 0.5, 0.8])
DIRECTIONS = np.concatenate([_FACES, _CORNERS]) @ _turned(_QUATERNION)  # (14, 3) unit vectors
WEIGHTS = np.repeat([1 / 15, 3 / 40], [6, 8])  # (14,), with a sum of one


def side_shares(directions: np.ndarray) -> np.ndarray:
    """Return the weights (..., 6) of `SIDES` for unit vectors (..., 3)."""
    shares = np.square(directions)
    return np.stack([shares * (directions > 0.0), shares * (directions < 0.0)], axis=-1).reshape(*shares.shape[:-1], 6)


def side_means(values: np.ndarray, directions: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return means (6, C) over each side of values (N, C) in directions (N, 3) with solid-angle weights (N,)."""
    shares = side_shares(directions) * weights[:, None]
    return shares.T @ values / shares.sum(axis=0)[:, None]
