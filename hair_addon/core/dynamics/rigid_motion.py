# SPDX-License-Identifier: GPL-3.0-or-later
"""How points on straight lines between two poses turn and move as a whole, and how far any moves otherwise."""

import math

import numpy as np

STILL = np.eye(3), np.zeros(3)


class RigidMotion:
    """Of points from `before` to `after`, (V, 3) float32 [m]: the rotation of least squares [Kabsch76]."""

    def __init__(self, before: np.ndarray, after: np.ndarray) -> None:
        self._centre, end = (pose.mean(axis=0, dtype=np.float64) for pose in (before, after))
        self._way = end - self._centre
        start = before - self._centre.astype(np.float32)
        self._radius = largest(start)
        end_offsets = after - end.astype(np.float32)
        self._axis, self._angle = _axis_and_angle(_rotation(start, end_offsets))
        self._rest = largest(end_offsets - start @ np.float32(self._turn(self._angle).T))
        rest_of_none = largest(end_offsets - start)
        if rest_of_none <= self._rest:
            self._angle, self._rest = 0.0, rest_of_none

    def between(self, first: float, last: float) -> tuple[tuple[np.ndarray, np.ndarray], float]:
        """The motion between two parts 0..1: (rotation (3, 3), translation [m]), and a bound of the rest [m].

        Points at part p are c + p d + (1 - p + p R) a + p e, for the centre c, its way d, offsets a and a rest e. Their
        whole turns by φ(p) then, with tan φ = p sin θ / (1 - p + p cos θ).
        """
        turn = self._turn(self._turned(last) - self._turned(first))
        narrowed = self._offsets(last) - turn @ self._offsets(first)
        rest = np.linalg.norm(narrowed, 2) * self._radius
        return (turn, self._shift(turn, first, last)), float(rest) + self._rest_of(turn, first, last)

    def carried(self, first: float, last: float) -> tuple[tuple[np.ndarray, np.ndarray], float]:
        """As `between`, but by a matrix that also narrows as the lines do: the rest is what bends or grows, at most."""
        carry = self._offsets(last) @ np.linalg.inv(self._offsets(first))
        return (carry, self._shift(carry, first, last)), self._rest_of(carry, first, last)

    def _offsets(self, part):
        return (1.0 - part) * np.eye(3) + part * self._turn(self._angle)

    def _shift(self, matrix, first, last):
        return self._centre + last * self._way - matrix @ (self._centre + first * self._way)

    def _rest_of(self, matrix, first, last):
        return float(np.linalg.norm(last * np.eye(3) - first * matrix, 2)) * self._rest

    def _turned(self, part):
        return math.atan2(part * math.sin(self._angle), 1.0 - part + part * math.cos(self._angle))

    def _turn(self, angle):
        """The rotation by an angle about the axis: Rodrigues' formula."""
        x, y, z = self._axis
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)


def _rotation(start, end):
    left, _, right = np.linalg.svd((end.T @ start).astype(np.float64))
    flip = np.diag([1.0, 1.0, 1.0 if np.linalg.det(left @ right) > 0.0 else -1.0])
    return left @ flip @ right


def _axis_and_angle(turn):
    """Unit axis and angle of a rotation; none for one by nearly 180°."""
    twice = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = 0.5 * np.linalg.norm(twice)
    angle = math.atan2(sine, 0.5 * (np.trace(turn) - 1.0))
    if sine < 1e-9 or angle > 2.5:  # wider turns are narrowed to a line on the way
        return np.array([0.0, 0.0, 1.0]), 0.0
    return 0.5 * twice / sine, angle


def largest(offsets: np.ndarray) -> float:
    """The length of the longest of offsets (V, 3)."""
    return math.sqrt(np.einsum("vi,vi->v", offsets, offsets).max())
