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
from .pigment import color_from_falloff
from .principled import variance_from_roughness

_LEAST_EXPONENT, _GREATEST_EXPONENT = 1.0, 10000.0


@dataclass(frozen=True)
class Settings(_Settings):
    """An opaque fibre. The defaults send back some 0.3 of red light evenly and 0.1 in the highlight."""

    diffuse_color: tuple = param(
        (0.30, 0.18, 0.10), "Part of the light that the fibre scatters evenly", low=0.0, high=1.0, subtype="COLOR"
    )
    specular_color: tuple = param(
        (0.050, 0.047, 0.043), "Brightness of the highlight's middle", low=0.0, high=1.0, subtype="COLOR"
    )
    exponent: float = param(
        60.0, "Sharpness of the highlight", low=_LEAST_EXPONENT, high=_GREATEST_EXPONENT, soft_high=500.0
    )


@dataclass(frozen=True)
class StrandSettings(_Settings):
    """Strands that differ in absorption and roughness: what the colours and the highlight of each follow from."""

    falloff: float = param(5.5, "How fast ln(colour) falls with the root of absorption", low=0.0)
    reflectance: float = param(0.1, "What the surface reflects of light from everywhere", low=0.0, high=1.0)
    roughness: float = param(0.3, "Longitudinal roughness of an average strand", low=0.0, high=1.0)
    coat: float = param(0.0, "How much sharper the highlight is than that roughness", low=0.0, high=1.0)


def highlight_exponent(roughness):
    """Exponent (...) of a highlight as wide as the R lobe of a longitudinal roughness (...)."""
    return np.clip(1.0 / variance_from_roughness(roughness), _LEAST_EXPONENT, _GREATEST_EXPONENT)


def highlight_peak(reflectance, exponent):
    """Brightness (...) of the middle of a highlight that returns `reflectance` of a uniform surrounding; at most 1."""
    return np.minimum(reflectance / kajiya_kay_specular_albedo(exponent), 1.0)


def kajiya_kay_of_strands(tangent, to_light, to_view, settings, sigma_a, roughness):
    """`kajiya_kay` (..., 3) of `StrandSettings`, for strands of absorption (..., 3) and roughness (...)."""
    exponent = highlight_exponent((1.0 - settings.coat) * roughness)
    peak = highlight_peak(settings.reflectance, exponent)
    diffuse = kajiya_kay_diffuse(tangent, to_light)[..., None] / np.pi**2
    specular = peak * kajiya_kay_specular(tangent, to_light, to_view, exponent)
    return color_from_falloff(sigma_a, settings.falloff) * diffuse + specular[..., None]


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


def mean_albedo_of_strands(settings, sigma_a):
    """The mean (3,) of `mean_albedo` over strands of `StrandSettings` with absorptions (..., 3)."""
    exponent = highlight_exponent((1.0 - settings.coat) * settings.roughness)
    specular = highlight_peak(settings.reflectance, exponent) * kajiya_kay_specular_albedo(exponent)
    return color_from_falloff(sigma_a, settings.falloff).reshape(-1, 3).mean(axis=0) + specular
