# SPDX-License-Identifier: GPL-3.0-or-later
"""Scattering of a path at a fiber: value and sampling of `energy_conserving` [DEon11] [Chiang16] for one offset h of
the ray within the fiber's width. The mean over h is the scattering of the fiber.
"""

import warp as wp

from ..fibre.scattering_kernel import attenuation as attenuation_of
from ..fibre.scattering_kernel import (
    crossing_length,
    exit_angle,
    lobe_of,
    reflectance,
    shifted_lobe,
)

wp.set_module_options({"enable_backward": False, "fast_math": True})

PI = wp.constant(wp.pi)
_STEEPEST = wp.constant(0.99999)  # sine of an inclination
_RESIDUAL = wp.constant(3)  # index that stands for all longer paths


@wp.struct
class Fibre:
    """The settings of a fiber where a path hits it."""

    tangent: wp.vec3
    sigma_a: wp.vec3
    roughness: float
    eta: float
    scale: float  # of the azimuthal logistic [rad]
    tilt: float
    tilt_trt: float
    coat: float


@wp.func
def transmittance(h: float, sin_o: float, cos_o: float, eta: float, sigma_a: wp.vec3):
    """Light left after one crossing of the fiber."""
    length = crossing_length(h, sin_o, cos_o, eta)
    return wp.vec3(wp.exp(-sigma_a[0] * length), wp.exp(-sigma_a[1] * length), wp.exp(-sigma_a[2] * length))


@wp.func
def attenuation(path: int, fresnel: float, crossing: wp.vec3):
    """Attenuation of R, TT, TRT, or all longer paths."""
    return wp.vec3(
        attenuation_of(path, fresnel, crossing[0]),
        attenuation_of(path, fresnel, crossing[1]),
        attenuation_of(path, fresnel, crossing[2]),
    )


@wp.func
def lobe(path: int, fibre: Fibre):
    """(shift, variance) of a lobe."""
    shift, v = lobe_of(path, fibre.tilt, fibre.tilt_trt, fibre.roughness, fibre.coat)
    return shift, v


@wp.func
def longitudinal(sin_i: float, sin_o: float, shift: float, v: float):
    """`shifted_lobe` of sines alone."""
    cos_i = wp.sqrt(1.0 - sin_i * sin_i)
    cos_o = wp.sqrt(1.0 - sin_o * sin_o)
    return shifted_lobe(sin_i, cos_i, sin_o, cos_o, shift, v)


@wp.func
def logistic_part(scale: float):
    """Fraction of a logistic distribution beyond pi, on each side."""
    return 1.0 / (1.0 + wp.exp(PI / scale))


@wp.struct
class Between:
    """The parts of `value` that are the same for all offsets; angle: between the directions around the fiber [rad];
    along: `longitudinal` of each lobe; around: factor of the azimuthal logistic.
    """

    sin_o: float
    cos_o: float
    angle: float
    along: wp.vec4
    around: float


@wp.func
def between(fibre: Fibre, viewer: wp.vec3, light: wp.vec3):
    """Return `Between` of the directions to the viewer and the light, unit vectors from the fiber."""
    found = Between()
    sin_o = wp.clamp(wp.dot(fibre.tangent, viewer), -_STEEPEST, _STEEPEST)
    sin_i = wp.clamp(wp.dot(fibre.tangent, light), -_STEEPEST, _STEEPEST)
    found.sin_o = sin_o
    found.cos_o = wp.sqrt(1.0 - sin_o * sin_o)
    x = wp.normalize(viewer - sin_o * fibre.tangent)
    found.angle = wp.atan2(wp.dot(light, wp.cross(fibre.tangent, x)), wp.dot(light, x))
    for path in range(4):
        shift, v = lobe(path, fibre)
        found.along[path] = longitudinal(sin_i, sin_o, shift, v)
    found.around = 1.0 / (fibre.scale * (1.0 - 2.0 * logistic_part(fibre.scale)))
    return found


@wp.func
def value_at(fibre: Fibre, pair: Between, h: float, weight: wp.vec3):
    """Return `value` at an offset h."""
    fresnel = reflectance(pair.cos_o * wp.sqrt(1.0 - h * h), fibre.eta)
    crossing = transmittance(h, pair.sin_o, pair.cos_o, fibre.eta, fibre.sigma_a)
    gamma = wp.asin(h)
    total = wp.vec3(0.0, 0.0, 0.0)
    of_all = float(0.0)
    for path in range(4):
        part = pair.along[path]
        if path == _RESIDUAL:
            part = part / (2.0 * PI)
        else:
            turned = pair.angle - exit_angle(path, h, gamma, pair.sin_o, pair.cos_o, fibre.eta)
            turned = turned - 2.0 * PI * wp.floor(turned / (2.0 * PI) + 0.5)
            e = wp.exp(-wp.abs(turned) / fibre.scale)
            part = part * pair.around * e / ((1.0 + e) * (1.0 + e))
        left = attenuation(path, fresnel, crossing)
        total += part * left
        of_all += wp.dot(weight, left)
    return total, wp.dot(weight, total) / wp.max(of_all, 1e-30)


@wp.func
def value(fibre: Fibre, viewer: wp.vec3, light: wp.vec3, h: float, weight: wp.vec3):
    """Return (radiance towards the viewer for unit irradiance from the light, density [1/sr] with which `turn` samples
    the light's direction for a path of this weight); viewer, light: unit vectors from the fiber.
    """
    found, density = value_at(fibre, between(fibre, viewer, light), h, weight)
    return found, density


@wp.func
def even_return(fibre: Fibre, viewer: wp.vec3):
    """Return the radiance towards the viewer in uniform light of radiance one, the mean over the width."""
    sin_o = wp.clamp(wp.dot(fibre.tangent, viewer), -_STEEPEST, _STEEPEST)
    cos_o = wp.sqrt(1.0 - sin_o * sin_o)
    total = wp.vec3(0.0, 0.0, 0.0)
    in_all = float(0.0)
    for step in range(8):
        gamma = (float(step) + 0.5) * (PI / 16.0)  # a variable in which reflection at the edges is smooth
        weight = wp.cos(gamma)
        fresnel = reflectance(cos_o * weight, fibre.eta)
        crossing = transmittance(wp.sin(gamma), sin_o, cos_o, fibre.eta, fibre.sigma_a)
        for path in range(4):
            total += weight * attenuation(path, fresnel, crossing)
        in_all += weight
    return total / in_all


@wp.func
def turn(fibre: Fibre, viewer: wp.vec3, weight: wp.vec3, h: float, random: wp.uint32):
    """Sample the direction of light that is scattered to the viewer at an offset h.

    Returns (direction, new weight of the path, random state).
    """
    state = random
    sin_o = wp.clamp(wp.dot(fibre.tangent, viewer), -_STEEPEST, _STEEPEST)
    cos_o = wp.sqrt(1.0 - sin_o * sin_o)
    fresnel = reflectance(cos_o * wp.sqrt(1.0 - h * h), fibre.eta)
    crossing = transmittance(h, sin_o, cos_o, fibre.eta, fibre.sigma_a)
    of_r = wp.dot(weight, attenuation(0, fresnel, crossing))
    of_tt = wp.dot(weight, attenuation(1, fresnel, crossing))
    of_trt = wp.dot(weight, attenuation(2, fresnel, crossing))
    total = of_r + of_tt + of_trt + wp.dot(weight, attenuation(3, fresnel, crossing))
    chosen = wp.randf(state) * total
    path = int(_RESIDUAL)
    if chosen < of_r:
        path = 0
    elif chosen < of_r + of_tt:
        path = 1
    elif chosen < of_r + of_tt + of_trt:
        path = 2
    left = wp.cw_mul(weight, attenuation(path, fresnel, crossing))
    left = left * (total / wp.max(left[0] + left[1] + left[2], 1e-30))

    shift, v = lobe(path, fibre)
    sin_turned = sin_o * wp.cos(shift) - cos_o * wp.sin(shift)
    cos_turned = wp.abs(cos_o * wp.cos(shift) + sin_o * wp.sin(shift))
    u = wp.max(wp.randf(state), 1e-6)
    cos_t = 1.0 + v * wp.log(u + (1.0 - u) * wp.exp(-2.0 / v))
    sin_t = wp.sqrt(wp.max(0.0, 1.0 - cos_t * cos_t))
    sin_i = -cos_t * sin_turned + sin_t * wp.cos(2.0 * PI * wp.randf(state)) * cos_turned
    sin_i = wp.clamp(sin_i, -_STEEPEST, _STEEPEST)
    cos_i = wp.sqrt(1.0 - sin_i * sin_i)

    phi = 2.0 * PI * wp.randf(state)
    if path != _RESIDUAL:
        low = logistic_part(fibre.scale)
        q = wp.clamp(low + wp.randf(state) * (1.0 - 2.0 * low), 1e-7, 1.0 - 1e-7)
        phi = exit_angle(path, h, wp.asin(h), sin_o, cos_o, fibre.eta) - fibre.scale * wp.log(1.0 / q - 1.0)
    x = wp.normalize(viewer - sin_o * fibre.tangent)
    y = wp.cross(fibre.tangent, x)
    direction = sin_i * fibre.tangent + cos_i * (wp.cos(phi) * x + wp.sin(phi) * y)
    return wp.normalize(direction), left, state
