# SPDX-License-Identifier: GPL-3.0-or-later
"""What colours hair: pigment, or the colour of a full head of it, as absorption per fibre radius.

The numbers are those of Blender's Principled Hair, so that a viewport and a Cycles render may share them.
"""

import numpy as np

# Absorption of unit concentrations for red, green and blue [DEon11], in the scale of Cycles.
_EUMELANIN = np.array([0.506, 0.841, 1.653])
_PHEOMELANIN = np.array([0.343, 0.733, 1.924])

# What full melanin lets through of light: its absorption is finite.
LEAST_LIGHT = 1e-4

# Colours are held off 0 and 1: black would need infinite absorption, and white fibres scatter for ever.
_DARKEST = 1e-4
_BRIGHTEST = 0.9999


def sigma_a_from_melanin(melanin, redness):
    """Amount of pigment and its red share, both (...) in [0, 1] → sigma_a (..., 3) per fibre radius."""
    concentration = -np.log(np.maximum(1.0 - np.asarray(melanin, float), LEAST_LIGHT))[..., None]
    redness = np.asarray(redness, float)[..., None]
    return concentration * ((1.0 - redness) * _EUMELANIN + redness * _PHEOMELANIN)


def sigma_a_from_color(color, azimuthal_roughness=0.3):
    """Colour of a groom, linear RGB (..., 3) → the sigma_a (..., 3) of its fibres [Chiang16]."""
    color = np.clip(color, _DARKEST, _BRIGHTEST)
    return np.square(np.log(color) / color_falloff(azimuthal_roughness))


def color_from_sigma_a(sigma_a, azimuthal_roughness=0.3):
    """The colour, linear RGB (..., 3), that light takes on among many fibres of sigma_a (..., 3) [Chiang16]."""
    return color_from_falloff(sigma_a, color_falloff(azimuthal_roughness))


def color_from_falloff(sigma_a, falloff):
    """The same from the `color_falloff` of that roughness."""
    return np.exp(-falloff * np.sqrt(sigma_a))


def color_falloff(roughness):
    """Fit of [Chiang16] to path traced grooms: how fast ln(colour) falls with sqrt(sigma_a)."""
    return np.polynomial.polynomial.polyval(roughness, [5.969, -0.215, 2.532, -10.73, 5.574, 0.245])
