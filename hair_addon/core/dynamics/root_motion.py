# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion of the roots of simulated strands from frame to frame: jumps, and motion without effect on the hair.

A strand moves rigidly with its root if the root jumps: farther than the teleport distance, or by a large angle. With
inertia below 1, a fraction of the rigid motion of the whole surface moves all strands rigidly, without effect on their
shape.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import HairError
from ..kernels.checks import require_count
from .rod import rotations

TELEPORT_ANGLE = math.radians(120.0)  # per frame


@dataclass(frozen=True)
class RootPose:
    """Roots of S strands at one time.

    positions: (S, 3) float64 [m]; turns: (S, 4) float64, rotations of the surface relative to the groom; scale: of
    lengths relative to the groom. Raises `HairError` for non-finite values.
    """

    positions: np.ndarray
    turns: np.ndarray
    scale: float = 1.0

    def __post_init__(self) -> None:
        require_count("rotations of roots", len(self.turns), len(self.positions))
        if not (np.isfinite(self.positions).all() and np.isfinite(self.turns).all()):
            raise HairError("The surface has non-finite coordinates where hair grows on it.")
        if not (math.isfinite(self.scale) and self.scale > 0.0):
            raise HairError("The surface has no size: its scale is zero or not a number.")

    def carried(self, points: np.ndarray) -> np.ndarray:
        """Return points (S, N, 3) float64 of the groom, relative to each root, after they move with the surface."""
        return self.positions[:, None] + rotations.rotated(self.turns[:, None], self.scale * points)

    def moved(self, motion: "RigidMotion") -> "RootPose":
        """Return the pose after a rigid motion."""
        return replace(
            self, positions=motion.moved(self.positions), turns=rotations.product(motion.rotation, self.turns)
        )

    def with_rows(self, chosen: np.ndarray, other: "RootPose") -> "RootPose":
        """Return the pose with chosen roots from another pose; chosen: (M,) indices."""
        positions, turns = self.positions.copy(), self.turns.copy()
        positions[chosen], turns[chosen] = other.positions[chosen], other.turns[chosen]
        return replace(self, positions=positions, turns=turns)


@dataclass(frozen=True)
class RigidMotion:
    """A rotation (…, 4) about a center (…, 3) [m], followed by a translation; way: (…, 3) [m]."""

    rotation: np.ndarray
    center: np.ndarray
    way: np.ndarray

    def part(self, share: float) -> "RigidMotion":
        """Return a fraction in [0, 1] of the motion."""
        return RigidMotion(_power(self.rotation, share), self.center, share * self.way)

    def moved(self, points: np.ndarray) -> np.ndarray:
        """Return points (…, 3) [m] after the motion."""
        return self.center + rotations.rotated(self.rotation, points - self.center) + self.way


def rigid_motion(before: RootPose, after: RootPose) -> RigidMotion:
    """Return the rigid motion that best maps the roots from one pose to another.

    Its rotation is the mean of the surface's rotations at the roots, which is defined even for few roots in a line.
    """
    turned = rotations.product(after.turns, rotations.inverse(before.turns))
    center = before.positions.mean(axis=0)
    return RigidMotion(_mean(turned), center, after.positions.mean(axis=0) - center)


def ways(before: RootPose, after: RootPose) -> np.ndarray:
    """Return the distances (S,) that roots move [m]."""
    moved = after.positions - before.positions
    return np.sqrt(np.einsum("si,si->s", moved, moved))


def jumps(before: RootPose, after: RootPose, distance: float) -> np.ndarray:
    """Return (S,) bool: whether roots move farther than a distance [m], or turn by more than `TELEPORT_ANGLE`."""
    cosines = np.abs(np.einsum("si,si->s", before.turns, after.turns))
    return (ways(before, after) > distance) | (cosines < math.cos(TELEPORT_ANGLE / 2.0))


def jump_of(before: RootPose, after: RootPose, chosen: np.ndarray) -> RigidMotion:
    """Return the motion of each chosen root; chosen: (M,) indices or a mask."""
    turned = rotations.product(after.turns, rotations.inverse(before.turns))[chosen]
    return RigidMotion(turned, before.positions[chosen], (after.positions - before.positions)[chosen])


def _mean(turned):
    """Return the mean of rotations (S, 4): the dominant eigenvector of the sum of outer products [Markley07]."""
    return np.linalg.eigh(turned.T @ turned)[1][:, -1]


def _power(rotation, share):
    """Return a rotation by a fraction of its angle, along the shorter arc."""
    rotation = np.where(rotation[..., 3:] < 0.0, -rotation, rotation)
    sine = np.linalg.norm(rotation[..., :3], axis=-1, keepdims=True)
    angle = np.arctan2(sine, rotation[..., 3:])
    axis = rotation[..., :3] / np.where(sine > 0.0, sine, 1.0)
    return np.concatenate([axis * np.sin(share * angle), np.cos(share * angle)], axis=-1)
