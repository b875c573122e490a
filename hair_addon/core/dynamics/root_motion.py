# SPDX-License-Identifier: GPL-3.0-or-later
"""How the surface carries the roots of simulated strands from frame to frame: jumps, and motion that is not to be felt.

A strand whose root jumps, farther than the teleport distance or by a large angle, goes along as it is. With inertia
below 1, a part of the rigid motion of the whole surface carries everything, so that the hair does not feel that part.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import HairError
from ..kernels.checks import require_count
from .rod import rotations

TELEPORT_ANGLE = math.radians(120.0)  # in a frame


@dataclass(frozen=True)
class RootPose:
    """Where the surface has the roots of S strands at one time.

    positions: (S, 3) float64 [m]; turns: (S, 4) float64, rotations of the surface there since the groom; scale: of
    lengths since the groom. Raises `HairError` for what is not finite.
    """

    positions: np.ndarray
    turns: np.ndarray
    scale: float = 1.0

    def __post_init__(self) -> None:
        require_count("rotations of roots", len(self.turns), len(self.positions))
        if not (np.isfinite(self.positions).all() and np.isfinite(self.turns).all()):
            raise HairError("The surface has non-finite coordinates where hair grows on it.")
        if not (math.isfinite(self.scale) and self.scale > 0.0):
            raise HairError("The surface has no size: its scale is zero, or no number.")

    def carried(self, points: np.ndarray) -> np.ndarray:
        """Points (S, N, 3) of each strand as in the groom, from its root there → float64 where the surface has them."""
        return self.positions[:, None] + rotations.rotated(self.turns[:, None], self.scale * points)

    def moved(self, motion: "RigidMotion") -> "RootPose":
        """The same after a motion of all."""
        return replace(
            self, positions=motion.moved(self.positions), turns=rotations.product(motion.rotation, self.turns)
        )

    def with_rows(self, chosen: np.ndarray, other: "RootPose") -> "RootPose":
        """The same with some roots, (M,) indices, where another pose has them."""
        positions, turns = self.positions.copy(), self.turns.copy()
        positions[chosen], turns[chosen] = other.positions[chosen], other.turns[chosen]
        return replace(self, positions=positions, turns=turns)


@dataclass(frozen=True)
class RigidMotion:
    """A rotation (…, 4) about points (…, 3), and then a way (…, 3) [m]."""

    rotation: np.ndarray
    center: np.ndarray
    way: np.ndarray

    def part(self, share: float) -> "RigidMotion":
        """The same motion for a share 0..1 of the time."""
        return RigidMotion(_power(self.rotation, share), self.center, share * self.way)

    def moved(self, points: np.ndarray) -> np.ndarray:
        """Points (…, 3) [m] after the motion."""
        return self.center + rotations.rotated(self.rotation, points - self.center) + self.way


def rigid_motion(before: RootPose, after: RootPose) -> RigidMotion:
    """The rigid motion that takes roots nearest to where they are in `after`: least squares.

    Its rotation is the mean of those of the surface at the roots, which a few roots in a line determine as well.
    """
    turned = rotations.product(after.turns, rotations.inverse(before.turns))
    center = before.positions.mean(axis=0)
    return RigidMotion(_mean(turned), center, after.positions.mean(axis=0) - center)


def ways(before: RootPose, after: RootPose) -> np.ndarray:
    """(S,) how far roots move [m]."""
    moved = after.positions - before.positions
    return np.sqrt(np.einsum("si,si->s", moved, moved))


def jumps(before: RootPose, after: RootPose, distance: float) -> np.ndarray:
    """(S,) bool: whether roots move farther than a distance [m], or turn by more than `TELEPORT_ANGLE`."""
    cosines = np.abs(np.einsum("si,si->s", before.turns, after.turns))
    return (ways(before, after) > distance) | (cosines < math.cos(TELEPORT_ANGLE / 2.0))


def jump_of(before: RootPose, after: RootPose, chosen: np.ndarray) -> RigidMotion:
    """The motion of each of some roots, (M,) indices or a mask."""
    turned = rotations.product(after.turns, rotations.inverse(before.turns))[chosen]
    return RigidMotion(turned, before.positions[chosen], (after.positions - before.positions)[chosen])


def _mean(turned):
    """The rotation nearest to rotations (S, 4): the eigenvector of the sum of their outer products [Markley07]."""
    return np.linalg.eigh(turned.T @ turned)[1][:, -1]


def _power(rotation, share):
    """A rotation by a share of its angle, the shorter way."""
    rotation = np.where(rotation[..., 3:] < 0.0, -rotation, rotation)
    sine = np.linalg.norm(rotation[..., :3], axis=-1, keepdims=True)
    angle = np.arctan2(sine, rotation[..., 3:])
    axis = rotation[..., :3] / np.where(sine > 0.0, sine, 1.0)
    return np.concatenate([axis * np.sin(share * angle), np.cos(share * angle)], axis=-1)
