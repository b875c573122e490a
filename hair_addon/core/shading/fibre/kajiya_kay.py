# SPDX-License-Identifier: GPL-3.0-or-later
"""The opaque cylinder of [Kajiya89], Eq. 11-13 of [Report12].

Convention: light with irradiance E on a plane facing the light results in the radiance `kajiya_kay(...) * E`, which
includes the cosine of the light's inclination.
"""

from dataclasses import dataclass

import numpy as np

from ...params import Settings as _Settings
from ...params import param
from .angles import Values, sin_from_cos
from .pigment import color_from_falloff
from .principled import variance_from_roughness

_LEAST_EXPONENT, _GREATEST_EXPONENT = 1.0, 10000.0


@dataclass(frozen=True)
class Settings(_Settings):
    """An opaque fiber. With the defaults, diffuse reflection returns 0.3 of red light and the highlight 0.1."""

    diffuse_color: tuple = param((0.30, 0.18, 0.10), "Diffuse albedo of the fiber", low=0.0, high=1.0, subtype="COLOR")
    specular_color: tuple = param(
        (0.050, 0.047, 0.043), "Intensity of the highlight at its peak", low=0.0, high=1.0, subtype="COLOR"
    )
    exponent: float = param(
        60.0, "Sharpness of the highlight", low=_LEAST_EXPONENT, high=_GREATEST_EXPONENT, soft_high=500.0
    )


@dataclass(frozen=True)
class StrandSettings(_Settings):
    """Settings of strands that vary in absorption and roughness."""

    falloff: float = param(5.5, "Decrease of ln(color) with the square root of absorption", low=0.0)
    reflectance: float = param(0.1, "Directional albedo of the surface under uniform light", low=0.0, high=1.0)
    roughness: float = param(0.3, "Mean longitudinal roughness of the strands", low=0.0, high=1.0)
    coat: float = param(0.0, "Reduction of the roughness for the highlight", low=0.0, high=1.0)


def highlight_exponent(roughness: Values) -> np.ndarray:
    """Return the exponent (...) of a highlight as wide as the R lobe of a longitudinal roughness (...)."""
    return np.clip(1.0 / variance_from_roughness(roughness), _LEAST_EXPONENT, _GREATEST_EXPONENT)


def highlight_peak(reflectance: Values, exponent: Values) -> np.ndarray:
    """Return the peak (...) of a highlight whose directional albedo under uniform light is `reflectance`; at most 1."""
    return np.minimum(reflectance / kajiya_kay_specular_albedo(exponent), 1.0)


def kajiya_kay_of_strands(
    tangent: np.ndarray,
    to_light: np.ndarray,
    to_view: np.ndarray,
    settings: StrandSettings,
    sigma_a: np.ndarray,
    roughness: Values,
) -> np.ndarray:
    """Return `kajiya_kay` (..., 3) of `StrandSettings`, for strands of absorption (..., 3) and roughness (...)."""
    exponent = highlight_exponent((1.0 - settings.coat) * roughness)
    peak = highlight_peak(settings.reflectance, exponent)
    diffuse = kajiya_kay_diffuse(tangent, to_light)[..., None] / np.pi**2
    specular = peak * kajiya_kay_specular(tangent, to_light, to_view, exponent)
    return color_from_falloff(sigma_a, settings.falloff) * diffuse + specular[..., None]


def kajiya_kay_diffuse(tangent: np.ndarray, to_light: np.ndarray) -> np.ndarray:
    """Return sin(T, L), the cosine of the light's inclination, (...). Eq. 11.

    The value is one for light perpendicular to the fiber and zero for light along it; the report states the opposite.
    """
    return sin_from_cos(np.sum(tangent * to_light, axis=-1))


def kajiya_kay_specular(tangent: np.ndarray, to_light: np.ndarray, to_view: np.ndarray, exponent: Values) -> np.ndarray:
    """Return max(0, cos(theta_i + theta_o))^exponent, (...), 1 on the mirror cone theta_o = -theta_i. Eq. 12.

    This departs from the report: the second sine is of V, and the product of cosines is subtracted because L and V
    both point away from the fiber.
    """
    t_dot_l = np.sum(tangent * to_light, axis=-1)
    t_dot_v = np.sum(tangent * to_view, axis=-1)
    cone = sin_from_cos(t_dot_l) * sin_from_cos(t_dot_v) - t_dot_l * t_dot_v
    return np.maximum(0.0, cone) ** exponent


def kajiya_kay(tangent: np.ndarray, to_light: np.ndarray, to_view: np.ndarray, settings: Settings) -> np.ndarray:
    """Return radiance per irradiance toward the viewer, RGB (..., 3). Eq. 13; its K is part of the colors."""
    diffuse = kajiya_kay_diffuse(tangent, to_light)[..., None]
    specular = kajiya_kay_specular(tangent, to_light, to_view, settings.exponent)[..., None]
    # The integral of sin(T, L) over the sphere is pi^2: divided by it, the diffuse color is an albedo.
    return np.asarray(settings.diffuse_color) * diffuse / np.pi**2 + np.asarray(settings.specular_color) * specular


def kajiya_kay_specular_albedo(exponent: Values) -> np.ndarray:
    """Return the directional albedo of a highlight of peak one under uniform light, the mean over all views.

    The exact value is pi / 2 times the integral of cos^n(s) ((pi - |s|) cos(s) + sin(|s|)) over s = theta_i + theta_o;
    the approximation is within 0.5 % for exponents of 10 and more, 4 % for 1.
    """
    return 0.5 * np.pi**2 * np.sqrt(2.0 * np.pi / (exponent + 1.5))


def mean_albedo(settings: Settings) -> np.ndarray:
    """Return the radiance in uniform light of radiance one, RGB (3,), as `albedo.mean_albedo` for Marschner."""
    specular = np.asarray(settings.specular_color) * kajiya_kay_specular_albedo(settings.exponent)
    return np.asarray(settings.diffuse_color) + specular


def mean_albedo_of_strands(settings: StrandSettings, sigma_a: np.ndarray) -> np.ndarray:
    """Return the mean (3,) of `mean_albedo` over strands of `StrandSettings` with absorptions (..., 3)."""
    exponent = highlight_exponent((1.0 - settings.coat) * settings.roughness)
    specular = highlight_peak(settings.reflectance, exponent) * kajiya_kay_specular_albedo(exponent)
    return color_from_falloff(sigma_a, settings.falloff).reshape(-1, 3).mean(axis=0) + specular
