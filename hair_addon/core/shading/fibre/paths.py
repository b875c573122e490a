# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through a smooth cylinder, flattened into its normal plane by the Bravais indices [Marschner03].

A path p crosses the inside p times: R, TT, TRT; RESIDUAL represents all longer paths. A ray is identified by gamma, its
angle of incidence in the normal plane; h = sin(gamma) is its offset from the axis. Lengths are in fiber radii.
cos_theta_d (...) in (0, 1].
"""

import numpy as np
from numpy.typing import ArrayLike

from .angles import Values
from .fresnel import bravais_indices, bravais_reflectance

R, TT, TRT, RESIDUAL = 0, 1, 2, 3


def exit_angle(p: int, gamma: Values, eta_prime: Values) -> np.ndarray:
    """Return phi (...) at which a ray with angle of incidence gamma leaves: R and TRT in (-pi, pi), TT in (0, 2 pi)."""
    gamma_t = np.arcsin(np.sin(gamma) / eta_prime)
    return 2.0 * p * gamma_t - 2.0 * gamma + (p % 2) * np.pi


def exit_angle_slope(p: int, gamma: Values, eta_prime: Values) -> np.ndarray:
    """Return d(phi) / d(gamma), finite at the fiber's rim where d(phi) / d(h) is not."""
    return 2.0 * p * np.cos(gamma) / np.sqrt(np.square(eta_prime) - np.square(np.sin(gamma))) - 2.0


def tt_gamma(phi: Values, eta_prime: Values) -> np.ndarray:
    """Return the unique gamma in [0, pi/2] of a TT path that leaves at phi in [0, pi]; pi/2 if there is none.

    From sin(gamma) = eta' sin(gamma - delta), where the ray turns by delta = gamma - gamma_t at each of two crossings.
    """
    delta = 0.5 * (np.pi - phi)
    return np.minimum(np.arctan2(eta_prime * np.sin(delta), eta_prime * np.cos(delta) - 1.0), 0.5 * np.pi)


def caustic_gamma(eta_prime: Values) -> np.ndarray:
    """Return gamma_c (...), where TRT's exit angle has its extremum; pi/2 for eta' of 2 and more, without extremum."""
    sin_squared = (4.0 - np.square(eta_prime)) / 3.0
    return np.where(sin_squared > 0.0, np.arcsin(np.sqrt(np.maximum(sin_squared, 0.0))), 0.5 * np.pi)


def trt_segments(eta_prime: Values) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return [(low, high, slope sign)], each (...): the intervals of gamma in which TRT's exit angle is monotone.

    For eta' of 2 and more it is monotone everywhere: the middle interval is the whole range, the others are empty.
    """
    gamma_c = caustic_gamma(eta_prime)
    rim = np.full_like(gamma_c, 0.5 * np.pi)
    falling = np.full_like(gamma_c, -1.0)
    return [
        (-rim, -gamma_c, falling),
        (-gamma_c, gamma_c, np.where(np.asarray(eta_prime) < 2.0, 1.0, -1.0)),
        (gamma_c, rim, falling),
    ]


def trt_gamma(
    phi: Values,
    low: np.ndarray,
    high: np.ndarray,
    slope_sign: np.ndarray,
    eta_prime: Values,
    bisections: int = 16,
    newton_steps: int = 2,
) -> np.ndarray:
    """Return gamma (...) in one monotone segment at which TRT leaves at phi; the segment's nearer end if there is none.

    Newton's steps square the remaining error of the bisection, and are limited to its interval, because the slope is
    nearly zero beside the caustic.
    """
    for _ in range(bisections):
        middle = 0.5 * (low + high)
        below = slope_sign * (exit_angle(TRT, middle, eta_prime) - phi) < 0.0
        low = np.where(below, middle, low)
        high = np.where(below, high, middle)
    gamma = 0.5 * (low + high)
    for _ in range(newton_steps):
        slope = slope_sign * np.maximum(np.abs(exit_angle_slope(TRT, gamma, eta_prime)), 1e-12)
        gamma = np.clip(gamma - (exit_angle(TRT, gamma, eta_prime) - phi) / slope, low, high)
    return gamma


def attenuation(fresnel: np.ndarray, transmittance: Values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (A_R, A_TT, A_TRT) from the reflectance and the transmittance of one crossing, broadcast.

    Eq. 17. The reflectance is the same inside, F(1/eta', 1/eta'', gamma_t), and outside.
    """
    through = np.square(1.0 - fresnel) * transmittance
    return fresnel, through, through * fresnel * transmittance


def residual_attenuation(fresnel: Values, transmittance: Values) -> np.ndarray:
    """Return the attenuation of all longer paths: the geometric series after TRT, for fresnel < 1 [Chiang16]."""
    turned = fresnel * transmittance
    return np.square((1.0 - fresnel) * turned) * transmittance / (1.0 - turned)


def crossing_transmittance(gamma: Values, cos_theta_d: Values, eta: Values, sigma_a: ArrayLike) -> np.ndarray:
    """Return T (..., C), the transmittance of one internal crossing; sigma_a (C,) per radius.

    The exponent is the length of the chord; the report's exponent, 1 + cos(2 gamma_t), is half the square of this
    length.
    """
    eta_prime, _ = bravais_indices(cos_theta_d, eta)
    cos_gamma_t = np.sqrt(1.0 - np.square(np.sin(gamma) / eta_prime))
    cos_theta_t = np.sqrt(np.square(eta) - 1.0 + np.square(cos_theta_d)) / eta
    length = 2.0 * cos_gamma_t / cos_theta_t
    return np.exp(-np.asarray(sigma_a) * length[..., None])


def path_attenuation(p: int, gamma: Values, cos_theta_d: Values, eta: Values, sigma_a: ArrayLike) -> np.ndarray:
    """Return A_p (..., C), or (..., 1) for R: the fraction of a ray's light that remains at its exit."""
    eta_prime, eta_double_prime = bravais_indices(cos_theta_d, eta)
    cos_gamma_t = np.sqrt(1.0 - np.square(np.sin(gamma) / eta_prime))
    fresnel = bravais_reflectance(np.cos(gamma), cos_gamma_t, eta_prime, eta_double_prime)[..., None]
    transmittance = 1.0 if p == R else crossing_transmittance(gamma, cos_theta_d, eta, sigma_a)
    if p == RESIDUAL:
        return residual_attenuation(fresnel, transmittance)
    return attenuation(fresnel, transmittance)[p]
