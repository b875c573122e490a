# SPDX-License-Identifier: GPL-3.0-or-later
"""The color of the light of a black body at a temperature, as in Cycles."""

import numpy as np

_LEAST, _MOST = 800.0, 12000.0  # [K] Cycles' color is constant beyond these
_COLDEST = 5.413294490189271, 0.0, 0.0
_HOTTEST = 0.8262954810464208, 0.9945080501520986, 1.566307710274283

# Fits of Planck's law in linear Rec. 709, from intern/cycles/kernel/svm/math_util.h of Blender: the first temperature
# [K] of each, with coefficients of (1 / t, t, 1) for red and for green, and of (t³, t², t, 1) for blue.
_FITS = (
    (
        6365.0,
        (3.78717450e03, 9.35907826e-06, 3.99075871e-01),
        (-5.00799571e02, -4.59832026e-06, 1.09098763e00),
        (6.72650283e-13, -2.73078809e-08, 4.24098264e-04, -7.52335691e-01),
    ),
    (
        3315.0,
        (4.59509185e03, 2.87495649e-05, 1.50345020e-01),
        (-1.17554822e03, -2.16378048e-05, 1.30408023e00),
        (-1.61997957e-13, -1.64216008e-08, 3.86216271e-04, -7.38077418e-01),
    ),
    (
        1902.0,
        (4.67028036e03, 2.91258199e-05, 1.26703442e-01),
        (-1.42529332e03, -4.01150431e-05, 1.43972784e00),
        (-1.97075738e-11, 1.75359352e-07, -2.50542825e-04, -2.22783266e-02),
    ),
    (
        1449.0,
        (4.09461742e03, -1.27446582e-04, 7.25731635e-01),
        (-1.26571316e03, 4.87340896e-06, 1.27054498e00),
        (-3.61460868e-11, 2.84822009e-07, -4.93211319e-04, 1.56723440e-01),
    ),
    (
        1167.0,
        (3.34143193e03, -4.86551192e-04, 1.76486769e00),
        (-1.02363977e03, 1.20223470e-04, 9.36662319e-01),
        (-1.40949732e-11, 1.89878968e-07, -3.56632824e-04, 9.10767778e-02),
    ),
    (
        965.0,
        (2.48845471e03, -1.11330907e-03, 3.22621544e00),
        (-7.55994277e02, 3.16730098e-04, 4.78306139e-01),
        (2.40430366e-11, 5.55021075e-08, -1.98503712e-04, 2.89312858e-02),
    ),
    (
        _LEAST,
        (1.61919106e03, -2.05010916e-03, 5.02995757e00),
        (-4.88999748e02, 6.04330754e-04, -7.55807526e-02),
        (5.96945309e-11, -4.85742887e-08, -9.70622247e-05, -4.07936148e-03),
    ),
)


def blackbody_color(temperature: float) -> np.ndarray:
    """Return the linear RGB (3,) of a black body at a temperature [K].

    The luminance is 1 before negative channels become 0.
    """
    if not temperature >= _LEAST:
        return np.array(_COLDEST)
    if temperature >= _MOST:
        return np.array(_HOTTEST)
    t = temperature
    _first, red, green, blue = next(fit for fit in _FITS if t >= fit[0])
    powers = np.array([1.0 / t, t, 1.0])
    return np.maximum([powers @ red, powers @ green, np.polyval(blue, t)], 0.0)
