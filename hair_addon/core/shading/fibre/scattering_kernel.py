# SPDX-License-Identifier: GPL-3.0-or-later
"""Scattering by one fiber as Warp functions in any precision: double precision for tables, single for paths.

Shaders that evaluate lobes include the same source, in single precision (`core/kernels/glsl_text.py`). The reference is
NumPy: `principled`, `longitudinal`, `fresnel` and `paths`. A ray is given by h, its offset from the axis in radii, and
by sine and cosine of its inclination theta_o to the fiber's normal plane. With theta_d in place of theta_o the
equations are those of the classic mode, because Bravais' indices depend on either angle in the same way.
"""

from typing import Any

import numpy as np
import warp as wp

from .longitudinal import BESSEL_FAR, BESSEL_NEAR
from .paths import RESIDUAL, TRT, TT, R
from .principled import LEAST_VARIANCE, LINEAR, QUADRATIC, STEEP

_NEAR = wp.constant(wp.types.vector(7, wp.float64)(*BESSEL_NEAR))
_FAR = wp.constant(wp.types.vector(9, wp.float64)(*BESSEL_FAR))
_PI = wp.constant(wp.float64(np.pi))
_ROOT_OF_TWO_PI = wp.constant(wp.float64(np.sqrt(2.0 * np.pi)))
_LINEAR, _QUADRATIC, _STEEP = (wp.constant(factor) for factor in (LINEAR, QUADRATIC, STEEP))
_LEAST_VARIANCE = wp.constant(LEAST_VARIANCE)
_R, _TT, _TRT, _RESIDUAL = (wp.constant(path) for path in (R, TT, TRT, RESIDUAL))


@wp.func
def deviation_from_roughness(roughness: Any):
    """Return `principled.deviation_from_roughness`."""
    wide = type(roughness)(_LINEAR) + type(roughness)(_QUADRATIC) * roughness
    return roughness * wide + type(roughness)(_STEEP) * wp.pow(roughness, type(roughness)(20.0))


@wp.func
def variance_from_roughness(roughness: Any):
    """Return `principled.variance_from_roughness`."""
    deviation = deviation_from_roughness(roughness)
    return wp.max(deviation * deviation, type(roughness)(_LEAST_VARIANCE))


@wp.func
def lobe_of(path: int, tilt: Any, tilt_trt: Any, roughness: Any, coat: Any):
    """Return (shift, variance) of a lobe: `energy_conserving.lobes`; tilt_trt: shift of TRT per tilt."""
    v = variance_from_roughness(roughness)
    if path == _R:
        return type(tilt)(-2.0) * tilt, variance_from_roughness((type(coat)(1.0) - coat) * roughness)
    if path == _TT:
        return tilt, wp.max(type(v)(0.25) * v, type(v)(_LEAST_VARIANCE))
    if path == _TRT:
        return tilt_trt * tilt, type(v)(4.0) * v
    return type(tilt)(0.0), type(v)(4.0) * v


@wp.func
def gaussian(x: Any, sigma: Any):
    """Return `marschner.gaussian`."""
    return wp.exp(type(x)(-0.5) * x * x / (sigma * sigma)) / (sigma * type(x)(_ROOT_OF_TWO_PI))


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


@wp.func
def shifted_lobe(sin_i: Any, cos_i: Any, sin_o: Any, cos_o: Any, shift: Any, v: Any):
    """Return `d_eon_lobe` with the view's inclination shifted back."""
    sin_turned = sin_o * wp.cos(shift) - cos_o * wp.sin(shift)
    cos_turned = wp.abs(cos_o * wp.cos(shift) + sin_o * wp.sin(shift))
    return d_eon_lobe(sin_i, cos_i, sin_turned, cos_turned, v)


@wp.func
def reflectance(cosine: Any, eta: Any):
    """`fresnel.dielectric_reflectance`, from outside; cosine: between ray and surface, cos(theta_o) cos(gamma)."""
    one = type(cosine)(1.0)
    c = wp.clamp(cosine, type(cosine)(0.0), one)
    inside = wp.sqrt(wp.max(type(cosine)(0.0), one - (one - c * c) / (eta * eta)))
    parallel = (eta * c - inside) / (eta * c + inside)
    perpendicular = (c - eta * inside) / (c + eta * inside)
    return type(cosine)(0.5) * (parallel * parallel + perpendicular * perpendicular)


@wp.func
def crossing_length(h: Any, sin_o: Any, cos_o: Any, eta: Any):
    """Length of one crossing of the fiber, in radii: the exponent of `paths.crossing_transmittance`."""
    root = wp.sqrt(eta * eta - sin_o * sin_o)
    offset = h * cos_o / root
    return type(h)(2.0) * wp.sqrt(wp.max(type(h)(0.0), type(h)(1.0) - offset * offset)) * eta / root


@wp.func
def attenuation(path: int, fresnel: Any, crossing: Any):
    """`paths.path_attenuation` of R, TT, TRT or all longer paths, by the transmittance of one crossing."""
    if path == _R:
        return fresnel
    one = type(fresnel)(1.0)
    left = (one - fresnel) * (one - fresnel) * crossing
    if path == _TT:
        return left
    left = fresnel * (left * crossing)
    if path == _TRT:
        return left
    once = fresnel * crossing
    return left * once / (one - once)


@wp.func
def exit_angle(path: int, h: Any, gamma: Any, sin_o: Any, cos_o: Any, eta: Any):
    """Azimuth in which a path leaves: `paths.exit_angle` for R and TT, a whole turn more for TRT; h: sin(gamma)."""
    one = type(h)(1.0)
    inside = wp.asin(wp.clamp(h * cos_o / wp.sqrt(eta * eta - sin_o * sin_o), -one, one))
    return type(h)(path) * (type(h)(2.0) * inside + type(h)(_PI)) - type(h)(2.0) * gamma
