# SPDX-License-Identifier: GPL-3.0-or-later
"""Roughness sockets of Blender's Principled Hair ↔ widths of lobes [Chiang16]."""

import numpy as np

from .angles import Values

# Standard deviation of the R lobe in theta_i + theta_o = a b + c b² + d b^20 for the roughness b.
LINEAR, QUADRATIC, STEEP = 0.726, 0.812, 3.7

# Least roughness: its lobe (0.6 degrees) is about as wide as the sun's disk; narrower lobes exceed single precision.
LEAST_VARIANCE = 1e-4
# The azimuthal scale of roughness 0: a third of a degree, half a texel of a table of 256.
LEAST_SCALE = 0.006


def deviation_from_roughness(roughness: Values) -> Values:
    """Return the standard deviation [rad] of the R lobe in theta_i + theta_o; roughness: longitudinal, in [0, 1]."""
    return LINEAR * roughness + QUADRATIC * np.square(roughness) + STEEP * np.power(roughness, 20.0)


def variance_from_roughness(roughness: Values) -> np.ndarray:
    """Return v_R [rad²], the variance in theta_i + theta_o; roughness: longitudinal, in [0, 1]."""
    return np.maximum(np.square(deviation_from_roughness(roughness)), LEAST_VARIANCE)


def scale_from_radial_roughness(roughness: Values) -> np.ndarray:
    """Return s [rad], the scale of the azimuthal logistic; roughness: radial, in [0, 1]."""
    scale = np.sqrt(np.pi / 8.0) * (0.265 * roughness + 1.194 * roughness**2 + 5.372 * roughness**22)
    return np.maximum(scale, LEAST_SCALE)


def varied_roughness(roughness: Values, amount: float, random: Values) -> np.ndarray:
    """Return the roughness (...) of strands with random numbers (...) in [0, 1], as in Cycles.

    amount: maximum relative change.
    """
    return np.clip(roughness * (1.0 + 2.0 * (np.asarray(random) - 0.5) * amount), 0.0, 1.0)


def beta_r_from_roughness(roughness: Values) -> Values:
    """Return beta_R [rad], the deviation in theta_h: half that in theta_i + theta_o; roughness: longitudinal."""
    return 0.5 * deviation_from_roughness(roughness)


def roughness_from_beta_r(beta_r: float) -> float:
    """Return the longitudinal roughness, clamped to [0, 1]: the inverse of `beta_r_from_roughness`; beta_r [rad]."""
    roughness = np.linspace(0.0, 1.0, 4097)
    return float(np.interp(beta_r, beta_r_from_roughness(roughness), roughness))
