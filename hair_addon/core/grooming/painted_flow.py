# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow painted by a brush: guides near a stroke on the surface turn toward the direction of the stroke.

Each guide turns as a whole about its root: its lean turns about the surface normal to the direction of the stroke, and
guides that are steeper than the lift are laid down to it. The influence of a piece of the stroke accumulates with its
length, so that a slow mouse and a fast one have the same effect.
"""

import numpy as np

from ..geometry.transform import turned_about_roots
from .guide_shapes import turned, unit
from .guide_tool_settings import FlowSettings

_PACE = 0.5  # length of a stroke with its full effect, relative to the radius
_PIECE = 0.125  # length of the longest pieces, relative to the radius
_FACING = 0.5  # cosine between the normals of root and stroke from which the effect is full
_LEANING = 0.2  # sine of the angle to the normal above which a guide has a direction of its own


class PaintedFlow:
    """Accumulated effect of a stroke on roots (G, 3) [m] with unit normals (G, 3)."""

    def __init__(self, roots: np.ndarray, normals: np.ndarray, radius: float, strength: float) -> None:
        self._roots, self._normals = np.asarray(roots, np.float64), np.asarray(normals, np.float64)
        self._radius, self._strength = radius, strength
        self._mean = np.zeros((len(roots), 3))
        self.shares = np.zeros(len(roots))  # fraction of the turn, in [0, 1]

    @property
    def directions(self) -> np.ndarray:
        """(G, 3) unit directions along the surface at the roots; zero where the stroke has no effect."""
        height = np.sum(self._mean * self._normals, axis=1, keepdims=True)
        return unit(self._mean - height * self._normals)

    def extend(self, start: np.ndarray, end: np.ndarray, normal: np.ndarray) -> None:
        """Add a segment of a stroke from a point (3,) to another [m], on the surface with a unit normal (3,)."""
        start, along = np.asarray(start, np.float64), np.subtract(end, start, dtype=np.float64)
        length = float(np.linalg.norm(along))
        if not length > 0.0:
            return
        places = (self._roots - start) @ along / length
        beside = np.linalg.norm(self._roots - start - places[:, None] * along / length, axis=1)
        away = np.maximum(np.abs(places - 0.5 * length) - 0.5 * length, 0.0)
        rows = np.flatnonzero(np.maximum(beside, away) < self._radius)
        count = max(np.ceil(length / (_PIECE * self._radius)), 1.0)
        facing = _smoothstep(self._normals[rows] @ normal / _FACING)
        for number in _pieces_near(places[rows] / length * count, self._radius / length * count, count):
            middle = start + (number + 0.5) / count * along
            distances = np.linalg.norm(self._roots[rows] - middle, axis=1)
            effect = self._strength * facing * _smoothstep(1.0 - distances / self._radius)
            effect = 1.0 - (1.0 - effect) ** (length / count / (_PACE * self._radius))
            self._mean[rows] += effect[:, None] * (along / length - self._mean[rows])
            self.shares[rows] += effect * (1.0 - self.shares[rows])


def joined_flow(first: PaintedFlow, second: PaintedFlow) -> tuple[np.ndarray, np.ndarray]:
    """Return (directions (G, 3), shares (G,)) of two strokes that act at once, such as a stroke and its mirror image.

    The order of the strokes does not matter.
    """
    total = first.shares + second.shares
    mean = first.shares[:, None] * first.directions + second.shares[:, None] * second.directions
    agreement = np.linalg.norm(mean, axis=1) / np.where(total > 0.0, total, 1.0)
    return unit(mean), agreement * (total - first.shares * second.shares)


def turned_along(
    points: np.ndarray, normals: np.ndarray, flow: np.ndarray, shares: np.ndarray, settings: FlowSettings
) -> np.ndarray:
    """Return guides (S, P, 3) float32 [m] turned about their roots toward directions (S, 3) by shares (S,) in [0, 1].

    points (S, P, 3) [m]; normals (S, 3) and flow (S, 3): unit, at the roots. Segments keep their lengths; guides
    without share or length, and those without a direction, keep their bits.
    """
    normals = np.asarray(normals, np.float64)
    flow = unit(flow - np.sum(flow * normals, axis=1, keepdims=True) * normals)
    lean = unit(np.subtract(points[:, -1], points[:, 0], dtype=np.float64))
    shares = np.where(lean.any(axis=1) & flow.any(axis=1), np.asarray(shares, np.float64), 0.0)
    # Turn about the normal, if the guide leans to a side.
    height = np.clip(np.sum(lean * normals, axis=1), -1.0, 1.0)
    side = lean - height[:, None] * normals
    leaning = _smoothstep(np.linalg.norm(side, axis=1) / _LEANING)
    azimuth = np.arctan2(np.sum(normals * np.cross(side, flow), axis=1), np.sum(side * flow, axis=1))
    around = _rotations(normals, leaning * shares * azimuth)
    lean = np.einsum("sij,sj->si", around, lean)
    # Turn toward the surface, if the guide is steeper than the lift.
    side = unit(lean - height[:, None] * normals)
    ahead = unit(leaning[:, None] * side + (1.0 - leaning[:, None]) * flow)
    rise = np.minimum(np.arcsin(height), settings.lift)[:, None]
    aim = np.cos(rise) * ahead + np.sin(rise) * normals
    reached = turned(lean, aim, shares)
    axis = np.cross(lean, reached)
    down = _rotations(unit(axis), np.arctan2(np.linalg.norm(axis, axis=1), np.sum(lean * reached, axis=1)))
    return turned_about_roots(points, down @ around, shares > 0.0)


def _rotations(axes, angles):
    """Return rotations (N, 3, 3) about unit axes (N, 3) by angles (N,) [rad]; the identity about a zero axis."""
    cross = np.zeros((len(axes), 3, 3))
    for row, column, part, sign in ((0, 1, 2, -1), (0, 2, 1, 1), (1, 2, 0, -1)):
        cross[:, row, column], cross[:, column, row] = sign * axes[:, part], -sign * axes[:, part]
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross)


def _pieces_near(places, reach, count):
    """Return the numbers of pieces, of which there are `count`, within a reach of places along them [pieces].

    Roots may be near only a few of the many pieces of a long stroke with a small radius.
    """
    steps = int(min(reach, count)) + 2
    nearest = np.unique(np.clip(np.floor(places), 0.0, count - 1.0))
    numbers = np.unique(nearest[:, None] + np.arange(-steps, steps + 1))
    return numbers[(numbers >= 0.0) & (numbers < count)]


def _smoothstep(x):
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)
