# SPDX-License-Identifier: GPL-3.0-or-later
"""Energy-conserving longitudinal scattering function of [DEon11].

The function is a density over solid angle in a slice of azimuth: the integral of the function times cos(theta_i) over
theta_i is 1 for every theta_o and variance. Marschner's Gaussian loses the part beyond the poles.
"""

import numpy as np

from .angles import Values

# [Abramowitz64, 9.8.1-2]: I0(x) in (x / 3.75)², and sqrt(x) exp(-x) I0(x) in 3.75 / x.
BESSEL_NEAR = (1.0, 3.5156229, 3.0899424, 1.2067492, 0.2659732, 0.0360768, 0.0045813)
BESSEL_FAR = (
    *(0.39894228, 0.01328592, 0.00225319, -0.00157565, 0.00916281),
    *(-0.02057706, 0.02635537, -0.01647633, 0.00392377),
)


def i0e(x: Values) -> np.ndarray:
    """Return exp(-x) I0(x), x >= 0 (...): the scaled modified Bessel function, with an error below 5e-7."""
    t = np.asarray(x) / 3.75
    near = np.exp(-np.minimum(x, 3.75)) * np.polynomial.polynomial.polyval(np.square(np.minimum(t, 1.0)), BESSEL_NEAR)
    far_t = np.maximum(t, 1.0)
    far = np.polynomial.polynomial.polyval(1.0 / far_t, BESSEL_FAR) / np.sqrt(3.75 * far_t)
    return np.where(t <= 1.0, near, far)


def d_eon_lobe(sin_i: Values, cos_i: Values, sin_o: Values, cos_o: Values, v: Values) -> np.ndarray:
    """Return M_v (...) of [DEon11] from sines and cosines of the inclinations; v: variance in theta_i + theta_o.

    The printed exp(-sin sin / v) I0(cos cos / v) / (2 v sinh(1 / v)) overflows below v = 0.01; here the exponents are
    combined first. cos(theta_i + theta_o) - 1 is computed as half a squared distance, which is accurate in single
    precision.
    """
    beside_cone = -0.5 * (np.square(sin_i + sin_o) + np.square(cos_i - cos_o))
    normalization = v * -np.expm1(-2.0 / v)
    return i0e(cos_i * cos_o / v) * np.exp(beside_cone / v) / normalization
