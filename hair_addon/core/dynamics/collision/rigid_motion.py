# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigid motion of points that are interpolated linearly between two poses, and bounds of the residual motion."""

import math

import numpy as np
from numpy.typing import ArrayLike

STILL = np.eye(3), np.zeros(3)


class RigidMotion:
    """Least-squares rigid motion of points from `before` to `after`, (V, 3) float32 [m] [Kabsch76]."""

    def __init__(self, before: np.ndarray, after: np.ndarray) -> None:
        self._centre, end = (pose.astype(np.float64).mean(axis=0) for pose in (before, after))
        self._way = end - self._centre
        start = before - self._centre.astype(np.float32)
        self._radius = largest(start)
        end_offsets = after - end.astype(np.float32)
        self._axis, self._angle = _axis_and_angle(_rotation(start, end_offsets))
        self._rest = largest(end_offsets - start @ np.float32(self._turn(self._angle).T))
        rest_of_none = largest(end_offsets - start)
        if rest_of_none <= self._rest:
            self._angle, self._rest = 0.0, rest_of_none

    def between(self, first: ArrayLike, last: ArrayLike) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        """Return the motion between two times in [0, 1]: (rotation (3, 3), translation [m]), bound of the residual [m].

        Arrays (…) of times give rotations (…, 3, 3), translations (…, 3) and bounds (…).

        Points at time p are c + p d + (1 - p + p R) a + p e, with the center c, its displacement d, offsets a and a
        residual e. Their common rotation has the angle φ(p), with tan φ = p sin θ / (1 - p + p cos θ).
        """
        first, last = np.asarray(first, np.float64), np.asarray(last, np.float64)
        turn = self._turn(self._turned(last) - self._turned(first))
        narrowed = self._offsets(last) - turn @ self._offsets(first)
        rest = _norm(narrowed) * self._radius
        return (turn, self._shift(turn, first, last)), rest + self._rest_of(turn, first, last)

    def carried(self, first: ArrayLike, last: ArrayLike) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
        """Return the motion as in `between`, with a matrix that includes the contraction by linear interpolation."""
        first, last = np.asarray(first, np.float64), np.asarray(last, np.float64)
        carry = self._offsets(last) @ np.linalg.inv(self._offsets(first))
        return (carry, self._shift(carry, first, last)), self._rest_of(carry, first, last)

    def _offsets(self, part):
        part = part[..., None, None]
        return (1.0 - part) * np.eye(3) + part * self._turn(self._angle)

    def _shift(self, matrix, first, last):
        first, last = first[..., None], last[..., None]
        mapped = (matrix @ (self._centre + first * self._way)[..., None])[..., 0]
        return self._centre + last * self._way - mapped

    def _rest_of(self, matrix, first, last):
        first, last = first[..., None, None], last[..., None, None]
        return _norm(last * np.eye(3) - first * matrix) * self._rest

    def _turned(self, part):
        sine, cosine = math.sin(self._angle), math.cos(self._angle)
        return _each(lambda part: math.atan2(part * sine, 1.0 - part + part * cosine), part)

    def _turn(self, angle):
        """Return the rotations by angles (…) about the axis, by Rodrigues' formula."""
        x, y, z = self._axis
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        sine, cosine = (_each(function, angle)[..., None, None] for function in (math.sin, math.cos))
        return np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross)


def _each(function, values):
    """Return the results of a function of Python's `math` for values (…): NumPy's results depend on the machine."""
    values = np.asarray(values)
    return np.array([function(value) for value in values.ravel().tolist()]).reshape(values.shape)


def _norm(matrices):
    """Return the spectral norms of matrices (…, 3, 3)."""
    return np.linalg.norm(matrices, 2, axis=(-2, -1))


def _rotation(start, end):
    left, _, right = np.linalg.svd((end.T @ start).astype(np.float64))
    flip = np.diag([1.0, 1.0, 1.0 if np.linalg.det(left @ right) > 0.0 else -1.0])
    return left @ flip @ right


def _axis_and_angle(turn):
    """Return the unit axis and the angle [rad] of a rotation; the angle is 0 for rotations near 180°."""
    twice = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = 0.5 * np.linalg.norm(twice)
    angle = math.atan2(sine, 0.5 * (np.trace(turn) - 1.0))
    if sine < 1e-9 or angle > 2.5:  # linear interpolation collapses larger rotations to a line on the way
        return np.array([0.0, 0.0, 1.0]), 0.0
    return 0.5 * twice / sine, angle


def largest(offsets: np.ndarray) -> float:
    """Return the greatest length of offsets (V, 3)."""
    return math.sqrt(np.einsum("vi,vi->v", offsets, offsets).max())
