# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient cube: six sides that represent all directions.

A direction contributes to the sides of the axes with its squared cosines, which sum to one.
"""

from itertools import product

import numpy as np

SIDES = ("+x", "-x", "+y", "-y", "+z", "-z")


def _turned(quaternion):
    """(3, 3) rotation of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


# To the faces and corners of a cube: with these weights the mean of a polynomial of degree 5 is exact [Lebedev76].
_FACES = np.concatenate([np.eye(3), -np.eye(3)])
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3))) / np.sqrt(3.0)
# Turned, as four of them would lie in the plane of a level surface, which would hide 0.37 of all directions.
_QUATERNION = np.array([3.0, 1.0, 0.5, 0.8])
DIRECTIONS = np.concatenate([_FACES, _CORNERS]) @ _turned(_QUATERNION)  # (14, 3) unit vectors
WEIGHTS = np.repeat([1 / 15, 3 / 40], [6, 8])  # (14,), of sum one


def side_shares(directions: np.ndarray) -> np.ndarray:
    """(..., 6): how far unit vectors (..., 3) belong to each of `SIDES`."""
    shares = np.square(directions)
    return np.stack([shares * (directions > 0.0), shares * (directions < 0.0)], axis=-1).reshape(*shares.shape[:-1], 6)


def side_means(values: np.ndarray, directions: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(6, C): means over each side of values (N, C) in directions (N, 3) that stand for parts (N,) of the sphere."""
    shares = side_shares(directions) * weights[:, None]
    return shares.T @ values / shares.sum(axis=0)[:, None]
