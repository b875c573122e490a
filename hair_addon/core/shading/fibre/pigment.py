# SPDX-License-Identifier: GPL-3.0-or-later
"""Absorption per fiber radius from pigment or from the overall color of hair.

The constants are those of Blender's Principled Hair, so that viewport and Cycles agree.
"""

import numpy as np
from numpy.typing import ArrayLike

from .angles import Values

# Absorption of unit concentrations for red, green and blue [DEon11], in the scale of Cycles.
EUMELANIN = np.array([0.506, 0.841, 1.653])
PHEOMELANIN = np.array([0.343, 0.733, 1.924])

FITTED_IOR = 1.55  # of the fibers to which [Chiang16] fitted colors

# Coefficients of `color_falloff` by powers of the azimuthal roughness [Chiang16].
FALLOFF = (5.969, -0.215, 2.532, -10.73, 5.574, 0.245)

# Transmittance of full melanin: zero would need infinite absorption.
LEAST_LIGHT = 1e-4

# Colors are limited to below 1 and above 0: black would need infinite absorption, and white fibers scatter forever.
_DARKEST = 1e-4
_BRIGHTEST = 0.9999


def sigma_a_from_melanin(melanin: Values, redness: Values) -> np.ndarray:
    """Return sigma_a (..., 3) per fiber radius of an amount of pigment and its red share, both (...) in [0, 1]."""
    concentration = -np.log(np.maximum(1.0 - np.asarray(melanin, float), LEAST_LIGHT))[..., None]
    redness = np.asarray(redness, float)[..., None]
    return concentration * ((1.0 - redness) * EUMELANIN + redness * PHEOMELANIN)


def sigma_a_from_color(color: ArrayLike, azimuthal_roughness: Values = 0.3) -> np.ndarray:
    """Return sigma_a (..., 3) of the fibers of a groom with a color, linear RGB (..., 3) [Chiang16]."""
    return sigma_a_of_falloff(color, color_falloff(azimuthal_roughness))


def sigma_a_of_falloff(color: ArrayLike, falloff: Values) -> np.ndarray:
    """Return sigma_a (..., 3) of a groom with a color (..., 3) by the `color_falloff` of its azimuthal roughness."""
    return np.square(np.log(np.clip(color, _DARKEST, _BRIGHTEST)) / falloff)


def color_from_sigma_a(sigma_a: ArrayLike, azimuthal_roughness: Values = 0.3) -> np.ndarray:
    """Return the color, linear RGB (..., 3), of a groom whose fibers have sigma_a (..., 3) [Chiang16]."""
    return color_from_falloff(sigma_a, color_falloff(azimuthal_roughness))


def color_of_scattering(color: ArrayLike, scattering: Values) -> np.ndarray:
    """Return the color (..., 3) of hair whose fibers scatter more or less light; color (..., 3): for scattering 1.

    In a deep layer that absorbs a fraction K of the light and scatters a fraction S back, the reflectance R follows
    from K / S = (1 - R)² / (2 R) [Kubelka31]. K is constant, and S is multiplied by `scattering`, which is positive.
    """
    color = np.asarray(color, float)
    k, s = np.square(1.0 - color), 2.0 * color * scattering  # K and S up to a common factor
    return s / (s + k + np.sqrt(k * (k + 2.0 * s)))


def color_from_falloff(sigma_a: ArrayLike, falloff: Values) -> np.ndarray:
    """Return the color of many fibers of sigma_a (..., 3) by the `color_falloff` of their azimuthal roughness."""
    return np.exp(-falloff * np.sqrt(sigma_a))


def color_falloff(roughness: Values) -> np.ndarray:
    """Return the decrease of ln(color) with sqrt(sigma_a): the fit of [Chiang16] to path-traced grooms."""
    return np.polynomial.polynomial.polyval(roughness, FALLOFF)
