# SPDX-License-Identifier: GPL-3.0-or-later
"""The color of the light of a black body at a temperature."""

import numpy as np

# [K] Cycles' color is constant above `MOST`. Below `LEAST`, the approximation is off by more than 2 %.
LEAST, MOST = 2000.0, 12000.0

_SECOND_RADIATION = 1.438776877e-2  # [m K]
_TO_RGB = np.array(  # CIE XYZ → linear Rec. 709
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)


def blackbody_color(temperature: float) -> np.ndarray:
    """Return the linear RGB (3,) of a black body, with a luminance of 1; temperature: [K], limited to `MOST`.

    The color is the sum of Planck's law times the color matching functions.
    """
    wavelengths = np.arange(360.0, 831.0) * 1e-9
    exponents = _SECOND_RADIATION / (wavelengths * min(temperature, MOST))
    xyz = _matching_functions(1e9 * wavelengths) @ (wavelengths**-5 / np.expm1(exponents))
    return np.maximum(_TO_RGB @ (xyz / xyz[1]), 0.0)


def _matching_functions(wavelengths):
    """Return the CIE 1931 functions x, y, z (3, N) of wavelengths (N,) [nm], as sums of lobes [Wyman13]."""

    def lobe(center, below, above):
        return np.exp(-0.5 * ((wavelengths - center) * np.where(wavelengths < center, below, above)) ** 2)

    x = 0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323) - 0.065 * lobe(501.1, 0.0490, 0.0382)
    y = 0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322)
    z = 1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725)
    return np.stack([x, y, z])
