# SPDX-License-Identifier: GPL-3.0-or-later
"""Sag-free rest shapes, for which the groom is an equilibrium under gravity, in closed form [Hsu23].

With the forces F_j = Σ m g of all points beyond segment j, its rest length l_j and direction d_j in equilibrium:

    x_(j+1) - x_j = l_j (d_j + F_j / EA_j)                           stretch and shear
    τ_j = τ_(j+1) - l_j d_j × F_j,    G_jᵀ λ_j = τ_j                 moments, tip to root
    2 Im e_j = -α_j λ_j                                              bend and twist

The half rest rotation s_j is the solution of s e s = r, where r is the rotation from frame j - 1 to frame j:
s = e^-½ (e^½ r e^½)^½ e^-½. G depends on s, so the solution is iterated.

The equilibrium may be unstable: an upright strand falls like a column if Γ = ρA g L³ / EI exceeds 7.84 [Greenhill81].
"""

from dataclasses import dataclass

import numpy as np

from . import rotations
from .material import Material
from .rods import RestShape, combed_shape, half_rotations

ROUNDS = 20
MOST_BEND = 0.5 * np.sqrt(3.0)  # sine of half of 120°, the largest rotation of a joint between groom and rest shape
GREENHILL = 7.84


@dataclass(frozen=True)
class SagFree:
    """A `RestShape` with strands at rest in their groom, except for clipped joints.

    clipped: (S,) number of clipped joints.
    """

    rest: RestShape
    clipped: np.ndarray


def sag_free(groom: np.ndarray, material: Material, gravity: tuple[float, float, float]) -> SagFree:
    """Return the `SagFree` of strands (S, M+1, 3) [m] of a `Material` under gravity [m/s²]."""
    groom = np.asarray(groom, np.float64)
    forces = _forces(material, gravity)
    combed = combed_shape(groom)
    segments = np.diff(groom, axis=1)
    lengths = material.lengths
    for _ in range(3):  # strains depend on the rest lengths
        lengths, directions = _unstretched(segments, forces * (material.stretch_compliances * lengths)[..., None])
    frames = rotations.product(
        rotations.least_rotation(rotations.unit(segments), directions), combed.frames
    )  # includes the shear by transverse forces
    moments = _moments(lengths, directions, forces)
    before = np.concatenate([frames[:, :1], frames[:, :-1]], axis=1)
    compliances = np.stack(
        [material.bend_compliances] * 2 + [material.twist_ratio * material.bend_compliances], axis=-1
    )
    turns = rotations.product(rotations.inverse(before), frames)
    halves = half_rotations(frames)
    multipliers, is_clipped, halves = _bent(halves, before, turns, moments, compliances)
    for _ in range(ROUNDS - 1):
        multipliers, is_clipped, halves = _bent(halves, before, turns, moments, compliances)
    pulls = -lengths[..., None] * forces
    held = np.concatenate([multipliers, pulls], axis=-1)
    return SagFree(RestShape(lengths, halves, frames, held), is_clipped.sum(axis=1))


def least_stiffnesses(groom: np.ndarray, material: Material, gravity: tuple[float, float, float]) -> np.ndarray:
    """Return (S,) float64: the least factor of a material's bending stiffness with which each strand is stable.

    groom: (S, M+1, 3) [m]; gravity [m/s²]. 0 for hanging strands, whose tip is the lowest point.
    """
    down = np.asarray(gravity, np.float64)
    size = float(np.linalg.norm(down))
    if size == 0.0:
        return np.zeros(len(groom))
    heights = -np.asarray(groom, np.float64) @ (down / size)
    is_hanging = heights[:, -1] <= heights.min(axis=1)
    lengths = material.lengths.sum(axis=1)
    joint_lengths = np.concatenate(
        [material.lengths[:, :1] / 2.0, (material.lengths[:, :-1] + material.lengths[:, 1:]) / 2.0], axis=1
    )
    stiffness = (joint_lengths / material.bend_compliances).min(axis=1)  # least EI
    load = material.masses.sum(axis=1) * size * lengths**2 / stiffness  # Γ
    return np.where(is_hanging, 0.0, load) / GREENHILL


def _forces(material, gravity):
    """Return the weight (S, M, 3) [N] of all points beyond each segment."""
    beyond = np.cumsum(material.masses[:, :0:-1], axis=1)[:, ::-1]
    return beyond[..., None] * np.asarray(gravity, np.float64)


def _unstretched(segments, strains):
    """Return rest lengths l (S, M) and directions d of segments that equal l (d + strain) under load."""
    along = np.sum(segments * strains, axis=-1)
    rest = 1.0 - np.sum(strains**2, axis=-1)
    lengths = (np.sqrt(along**2 + rest * np.sum(segments**2, axis=-1)) - along) / rest
    return lengths, rotations.unit(segments - lengths[..., None] * strains)


def _moments(lengths, directions, forces):
    """Return the moments (S, M, 3) [N m] at joints, summed from tip to root."""
    turned = -lengths[..., None] * np.cross(directions, forces)
    return np.cumsum(turned[:, ::-1], axis=1)[:, ::-1]


def _bent(halves, before, turns, moments, compliances):
    """Return (multipliers, whether joints are clipped, half rest rotations) from the last round's half rotations."""
    back = rotations.inverse(halves)
    bend = rotations.product(rotations.product(back, turns), back)
    bend = np.where(bend[..., 3:] < 0.0, -bend, bend)
    multipliers = _multipliers(bend, rotations.rotated(rotations.inverse(rotations.product(before, halves)), moments))
    sine = -0.5 * compliances * multipliers
    size = np.linalg.norm(sine, axis=-1, keepdims=True)
    sine *= np.minimum(1.0, MOST_BEND / np.maximum(size, 1e-30))
    cosine = np.sqrt(1.0 - np.sum(sine**2, axis=-1, keepdims=True))
    root = rotations.half(np.concatenate([sine, cosine], axis=-1))
    middle = rotations.half(rotations.product(rotations.product(root, turns), root))
    back = rotations.inverse(root)
    return multipliers, size[..., 0] > MOST_BEND, rotations.product(rotations.product(back, middle), back)


def _multipliers(bend, moments):
    """Return the closed-form solution λ of (e_w 1 + [e_v]×) λ = moments for a unit quaternion e."""
    axis, real = bend[..., :3], bend[..., 3:]
    real = np.maximum(real, 1e-6)
    along = np.sum(axis * moments, axis=-1, keepdims=True)
    return real * moments - np.cross(axis, moments) + axis * (along / real)
