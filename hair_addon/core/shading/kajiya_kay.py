# SPDX-License-Identifier: GPL-3.0-or-later
"""The opaque cylinder of [Kajiya89], Eq. 11-13 of [Report12].

Convention: light that falls on the fibre with irradiance E on a plane facing the light leaves it with the radiance
`kajiya_kay(...) * E`. The cosine of the light's inclination is therefore already in it.
"""

from dataclasses import dataclass

import numpy as np

from ..params import Settings as _Settings
from ..params import param
from .angles import sin_from_cos


@dataclass(frozen=True)
class Settings(_Settings):
    """An opaque fibre. The defaults send back some 0.3 of red light evenly and 0.1 in the highlight."""

    diffuse_color: tuple = param(
        (0.30, 0.18, 0.10), "Part of the light that the fibre scatters evenly", low=0.0, high=1.0, subtype="COLOR"
    )
    specular_color: tuple = param(
        (0.050, 0.047, 0.043), "Brightness of the highlight's middle", low=0.0, high=1.0, subtype="COLOR"
    )
    exponent: float = param(60.0, "Sharpness of the highlight", low=1.0, high=10000.0, soft_high=500.0)


def kajiya_kay_diffuse(tangent, to_light):
    """sin(T, L), the cosine of the light's inclination, (...). Eq. 11.

    Greatest for light across the fibre and zero along it: the report's text says the opposite.
    """
    return sin_from_cos(np.sum(tangent * to_light, axis=-1))


def kajiya_kay_specular(tangent, to_light, to_view, exponent):
    """max(0, cos(theta_i + theta_o))^exponent, (...): 1 on the mirror cone theta_o = -theta_i. Eq. 12.

    Departs from the report: its second sine is of V, and the product of cosines is subtracted because L and V both
    point away from the fibre.
    """
    t_dot_l = np.sum(tangent * to_light, axis=-1)
    t_dot_v = np.sum(tangent * to_view, axis=-1)
    cone = sin_from_cos(t_dot_l) * sin_from_cos(t_dot_v) - t_dot_l * t_dot_v
    return np.maximum(0.0, cone) ** exponent


def kajiya_kay(tangent, to_light, to_view, settings):
    """Radiance per irradiance towards the viewer, RGB (..., 3). Eq. 13, with K taken into the colours."""
    diffuse = kajiya_kay_diffuse(tangent, to_light)[..., None]
    specular = kajiya_kay_specular(tangent, to_light, to_view, settings.exponent)[..., None]
    # The integral of sin(T, L) over the sphere is pi^2: divided by it, the diffuse colour is an albedo.
    return np.asarray(settings.diffuse_color) * diffuse / np.pi**2 + np.asarray(settings.specular_color) * specular


def kajiya_kay_specular_albedo(exponent):
    """What a highlight of peak one returns of a uniform surrounding, the mean over all directions of view.

    The exact value is pi / 2 times the integral of cos^n(s) ((pi - |s|) cos(s) + sin(|s|)) over s = theta_i + theta_o;
    this is within 0.5 % of it from the exponent 10 on, 4 % at 1.
    """
    return 0.5 * np.pi**2 * np.sqrt(2.0 * np.pi / (exponent + 1.5))


def mean_albedo(settings):
    """Radiance in a uniform surrounding of radiance one, RGB (3,), as `albedo.mean_albedo` for the Marschner model."""
    specular = np.asarray(settings.specular_color) * kajiya_kay_specular_albedo(settings.exponent)
    return np.asarray(settings.diffuse_color) + specular
