# SPDX-License-Identifier: GPL-3.0-or-later
"""`longitudinal` as Warp functions in any precision: tables are baked in double precision, paths take floats."""

from typing import Any

import warp as wp

from .longitudinal import BESSEL_FAR, BESSEL_NEAR

_NEAR = wp.constant(wp.types.vector(7, wp.float64)(*BESSEL_NEAR))
_FAR = wp.constant(wp.types.vector(9, wp.float64)(*BESSEL_FAR))


@wp.func
def i0e(x: Any):
    """Return exp(-x) I0(x) for x >= 0 [Abramowitz64, 9.8.1-2]."""
    t = x / type(x)(3.75)
    if t <= type(x)(1.0):
        square = t * t
        near = type(x)(_NEAR[6])
        for power in range(6):
            near = near * square + type(x)(_NEAR[5 - power])
        return wp.exp(-x) * near
    inverse = type(x)(1.0) / t
    far = type(x)(_FAR[8])
    for power in range(8):
        far = far * inverse + type(x)(_FAR[7 - power])
    return far / wp.sqrt(x)


@wp.func
def d_eon_lobe(sin_i: Any, cos_i: Any, sin_o: Any, cos_o: Any, v: Any):
    """Return M_v of [DEon11]; v: variance in theta_i + theta_o."""
    along = sin_i + sin_o
    across = cos_i - cos_o
    beside_cone = type(v)(-0.5) * (along * along + across * across)
    normalization = v * (type(v)(1.0) - wp.exp(type(v)(-2.0) / v))
    return i0e(cos_i * cos_o / v) * wp.exp(beside_cone / v) / normalization
