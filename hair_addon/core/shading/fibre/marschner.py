# SPDX-License-Identifier: GPL-3.0-or-later
"""Light scattered by a translucent fiber in three paths: R, TT and TRT [Marschner03], Eq. 14-17 of [Report12].

S = sum over the paths p of M_p(theta_h) N_p(theta_d, phi) / cos^2(theta_d). Lengths are in fiber radii, so sigma_a is
per radius. Functions are exact and vectorized over points; `lookup_tables` averages over texels.

Convention: light with irradiance E on a plane facing the light results in the radiance `scattering(...) * cos(theta_i)
* E`, averaged over the fiber's width.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...params import Settings as _Settings
from ...params import param
from . import paths
from .angles import FibreAngles, Values
from .fresnel import bravais_indices, dielectric_reflectance
from .pigment import sigma_a_from_melanin
from .principled import beta_r_from_roughness

# Shift of each lobe's center in theta_h per cuticle tilt. A traced tilted wedge gives -1, eta - 1, 2 eta - 1
# (-1, +0.55, +2.10 for hair), to which the values of Cycles are closer than the published values.
_SHIFTS = {"CYCLES": (-1.0, 0.5, 2.0), "PUBLISHED": (-1.0, 0.5, 1.5)}
_WIDTHS = (1.0, 0.5, 2.0)  # of each lobe, relative to R's [Marschner03]

# Keeps 1 / cos^2(theta_d) finite for light and view along the fiber, where cos(theta_i) is zero anyway.
LEAST_COS_THETA_D = 1e-3

LEAST_BETA_R, GREATEST_BETA_R = math.radians(1.0), math.radians(45.0)

_BROWN = tuple(round(float(channel), 3) for channel in sigma_a_from_melanin(0.659, 0.0))


@dataclass(frozen=True)
class Settings(_Settings):
    """The optics of a fiber with a circular section.

    Both modes use index, absorption and tilt; the settings of the energy-conserving mode follow, then those of the
    classic mode.
    """

    mode: str = param(
        "classic",
        "Version of the Marschner model that the viewport draws",
        label="Marschner variant",
        choices=(
            ("energy", "Energy Conserving", "Rough fiber that conserves energy, as in Cycles [Chiang16]"),
            ("classic", "Classic", "Smooth fiber with Gaussian highlights and glints [Marschner03]"),
        ),
    )
    eta: float = param(
        1.55,
        "Index of refraction of the fiber; higher values reflect more light",
        label="IOR",
        low=1.01,
        high=3.0,
        soft_high=2.0,
    )
    sigma_a: tuple = param(
        _BROWN,
        "Absorption of red, green, and blue light per fiber radius; higher values are darker",
        label="Absorption",
        low=0.0,
        high=1000.0,
    )
    tilt: float = param(
        math.radians(5.0),
        "Tilt of the cuticle scales; higher values move the highlights farther apart",
        label="Cuticle angle",
        low=math.radians(-20.0),
        high=math.radians(20.0),
        unit="ROTATION",
        subtype="ANGLE",
    )
    shifts: str = param(
        "CYCLES",
        "Shift of each highlight by the cuticle tilt",
        label="Highlight shifts",
        choices=(
            ("CYCLES", "Cycles", "-1, 1/2, and 2 times the tilt, close to a ray-traced fiber"),
            ("PUBLISHED", "Published", "-1, 1/2, and 3/2 times the tilt [Marschner03]"),
        ),
    )
    roughness: float = param(
        0.3,
        "Roughness along the fiber; higher values give wider, softer highlights",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    radial_roughness: float = param(
        0.3,
        "Roughness around the fiber; higher values spread light more evenly to the sides",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    coat: float = param(
        0.0,
        "Smoothness of the fiber surface; higher values sharpen the primary highlight",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    beta_r: float = param(
        math.radians(7.5),
        "Width of the primary highlight; the transmitted highlight is half as wide, the secondary one twice",
        label="Highlight width",
        low=LEAST_BETA_R,
        high=GREATEST_BETA_R,
        unit="ROTATION",
        subtype="ANGLE",
    )
    caustic: str = param(
        "published",
        "Treatment of the bright edges of the secondary highlight",
        choices=(
            ("published", "Smoothed", "Replace the edges with glints of a given width [Marschner03]"),
            ("exact", "Exact", "Keep the edges of a smooth cylinder"),
        ),
    )
    glint_gain: float = param(
        1.0, "Intensity of the glints (k_G); higher values are brighter", low=0.0, high=10.0, soft_high=5.0
    )
    glint_width: float = param(
        math.radians(15.0),
        "Azimuthal width of the glints (w_c)",
        low=math.radians(1.0),
        high=math.radians(60.0),
        unit="ROTATION",
        subtype="ANGLE",
    )
    glint_fade: float = param(
        0.3, "Range above an effective index of 2 over which the merged glint fades (delta eta')", low=0.01, high=2.0
    )
    glint_limit: float = param(
        0.5, "Maximum fraction of the fiber width that a glint gathers (delta h)", low=0.0, high=1.0
    )
    eccentricity: float = param(
        1.0,
        "Ratio of the axes of the fiber's cross section; lower values vary the secondary highlight more",
        low=0.85,
        high=1.0,
    )

    @property
    def is_elliptic(self) -> bool:
        """Whether the section is an ellipse, which only the classic mode supports."""
        return self.mode == "classic" and self.eccentricity < 1.0


def gaussian(x: Values, sigma: Values) -> np.ndarray:
    """Return the unit-area Gaussian of standard deviation sigma."""
    return np.exp(-0.5 * np.square(x / sigma)) / (sigma * math.sqrt(2.0 * math.pi))


def beta_r_of(roughness: Values) -> np.ndarray:
    """Return beta_R (...) [rad] of a longitudinal roughness (...) in [0, 1], clamped to the range of `Settings`."""
    return np.clip(beta_r_from_roughness(roughness), LEAST_BETA_R, GREATEST_BETA_R)


def longitudinal_lobes(settings: Settings, beta_r: Values | None = None) -> list[tuple[float, Values]]:
    """Return [(alpha, beta)] of R, TT and TRT: center and standard deviation in theta_h.

    beta_r: deviation (...) of R on varied strands; None: the deviation of the settings.
    """
    beta_r = settings.beta_r if beta_r is None else beta_r
    return [(s * settings.tilt, width * beta_r) for s, width in zip(_SHIFTS[settings.shifts], _WIDTHS, strict=True)]


def gaussian_lobes(theta_h: Values, settings: Settings, beta_r: Values | None = None) -> np.ndarray:
    """Return M_R, M_TT and M_TRT (..., 3) at theta_h (...); beta_r: as in `longitudinal_lobes`."""
    lobes = longitudinal_lobes(settings, beta_r)
    return np.stack([m_lobe(theta_h, alpha, beta) for alpha, beta in lobes], axis=-1)


def m_lobe(theta_h: Values, alpha: float, beta: Values) -> np.ndarray:
    """Return M (...), of unit area in theta_o. Eq. 15 with the missing factor ½, because d(theta_o) = 2 d(theta_h)."""
    return 0.5 * gaussian(theta_h - alpha, beta)


def _root_term(p, gamma, cos_theta_d, eta, sigma_a):
    """Return one root's contribution (..., C) to N_p: ½ A dh / d(phi), Eq. 16 with the exponent -1 instead of 2."""
    eta_prime, _ = bravais_indices(cos_theta_d, eta)
    slope = np.maximum(np.abs(paths.exit_angle_slope(p, gamma, eta_prime)), 1e-6)  # zero at the caustic
    return paths.path_attenuation(p, gamma, cos_theta_d, eta, sigma_a) * (0.5 * np.cos(gamma) / slope)[..., None]


def n_r(phi: Values, cos_theta_d: Values, eta: Values) -> np.ndarray:
    """Return N_R (...): a quarter of cos(phi / 2), times the reflectance of the facet that mirrors light to phi."""
    cos_half = np.cos(0.5 * np.abs(phi))
    return 0.25 * cos_half * dielectric_reflectance(cos_theta_d * cos_half, eta)


def n_tt(phi: Values, cos_theta_d: Values, eta: Values, sigma_a: ArrayLike) -> np.ndarray:
    """Return N_TT (..., C), zero for |phi| below 2 asin(1 / eta'), where no ray leaves after two crossings."""
    phi, cos_theta_d = np.broadcast_arrays(np.abs(phi), cos_theta_d)
    eta_prime, _ = bravais_indices(cos_theta_d, eta)
    lit = phi >= 2.0 * np.arcsin(1.0 / eta_prime)
    return lit[..., None] * _root_term(paths.TT, paths.tt_gamma(phi, eta_prime), cos_theta_d, eta, sigma_a)


def n_trt(phi: Values, cos_theta_d: Values, eta: Values, sigma_a: ArrayLike) -> np.ndarray:
    """Return N_TRT (..., C) of a smooth cylinder, exact: up to three roots, infinite at the caustic."""
    phi, cos_theta_d = np.broadcast_arrays(np.abs(phi), cos_theta_d)
    eta_prime, _ = bravais_indices(cos_theta_d, eta)
    total = np.zeros(phi.shape + np.shape(sigma_a))
    for low, high, slope_sign in paths.trt_segments(eta_prime):
        # Half-open, so that a root where two segments meet is counted once.
        crossed = (paths.exit_angle(paths.TRT, low, eta_prime) > phi) != (
            paths.exit_angle(paths.TRT, high, eta_prime) > phi
        )
        gamma = paths.trt_gamma(phi, low, high, slope_sign, eta_prime)
        total += crossed[..., None] * _root_term(paths.TRT, gamma, cos_theta_d, eta, sigma_a)
    return total


def n_trt_caustic(phi: Values, cos_theta_d: Values, settings: Settings) -> np.ndarray:
    """Return N_TRT (..., C) with a glint of finite width in place of the caustic [Marschner03]."""
    phi, cos_theta_d = np.broadcast_arrays(np.abs(phi), cos_theta_d)
    caustic = Caustic.at(cos_theta_d, settings, settings.sigma_a)
    smooth = n_trt(phi, cos_theta_d, settings.eta, settings.sigma_a) * caustic.remainder(phi)[..., None]
    return smooth + caustic.glint(phi)


@dataclass(frozen=True)
class Caustic:
    """TRT's caustic at cos(theta_d) (...), and its published treatment."""

    phi_c: np.ndarray  # azimuth of the caustic, (...)
    fade: np.ndarray  # 1 while there is a caustic, falling to 0 beyond eta' = 2, (...)
    area: np.ndarray  # of each of the two glints over phi, (..., C)
    width: float

    @classmethod
    def at(cls, cos_theta_d: Values, settings: Settings, sigma_a: ArrayLike) -> "Caustic":
        eta_prime, _ = bravais_indices(cos_theta_d, settings.eta)
        exists = eta_prime < 2.0
        gamma_c = np.where(exists, paths.caustic_gamma(eta_prime), 0.0)
        h_c = np.sin(gamma_c)
        curvature = 4.0 * h_c / (np.square(eta_prime) - h_c**2) ** 1.5 - 2.0 * h_c / (1.0 - h_c**2) ** 1.5
        # The interval of h whose rays leave within w_c of the caustic; at eta' = 2 all rays do, because the exit
        # angle is flat.
        interval = 2.0 * np.sqrt(2.0 * settings.glint_width / np.maximum(np.abs(curvature), 1e-12))
        interval = np.minimum(interval, settings.glint_limit)
        # 1 - smoothstep: the printed smoothstep would jump from 1 to 0 at eta' = 2.
        x = np.clip((eta_prime - 2.0) / settings.glint_fade, 0.0, 1.0)
        fade = 1.0 - x * x * (3.0 - 2.0 * x)
        attenuated = paths.path_attenuation(paths.TRT, gamma_c, cos_theta_d, settings.eta, sigma_a)
        area = (fade * settings.glint_gain * interval)[..., None] * attenuated
        return cls(
            np.where(exists, paths.exit_angle(paths.TRT, gamma_c, eta_prime), 0.0), fade, area, settings.glint_width
        )

    def rows(self, index: slice | np.ndarray) -> "Caustic":
        """Return the caustics of some of the cosines."""
        return Caustic(self.phi_c[index], self.fade[index], self.area[index], self.width)

    def remainder(self, phi: Values) -> np.ndarray:
        """Return the factor (...) that removes the caustic from N_TRT at phi (...)."""
        peak = gaussian(0.0, self.width)
        left = 1.0 - self.fade * gaussian(phi - self.phi_c, self.width) / peak
        return left * (1.0 - self.fade * gaussian(phi + self.phi_c, self.width) / peak)

    def glint(self, phi: Values) -> np.ndarray:
        """Return the glint that replaces the caustic, (..., C)."""
        both = gaussian(phi - self.phi_c, self.width) + gaussian(phi + self.phi_c, self.width)
        return self.area * both[..., None]


def scattering(angles: FibreAngles, settings: Settings) -> np.ndarray:
    """Return S (..., 3) [1/sr] at `FibreAngles` (...). Eq. 14."""
    cos_theta_d = np.maximum(np.cos(angles.theta_d), LEAST_COS_THETA_D)
    m = gaussian_lobes(angles.theta_h, settings)
    transmitted = n_tt(angles.phi, cos_theta_d, settings.eta, settings.sigma_a)
    reflected = n_r(angles.phi, cos_theta_d, settings.eta)[..., None]
    if settings.caustic == "exact":
        inner = n_trt(angles.phi, cos_theta_d, settings.eta, settings.sigma_a)
    else:
        inner = n_trt_caustic(angles.phi, cos_theta_d, settings)
    return marschner_scattering(m, np.concatenate([transmitted, reflected], axis=-1), inner, cos_theta_d)


def marschner_scattering(m: np.ndarray, n: np.ndarray, n_trt: np.ndarray, cos_theta_d: Values) -> np.ndarray:
    """Return S (..., 3) of m (..., 3) = M_R, M_TT, M_TRT; n (..., 4) = N_TT, N_R; and n_trt (..., 3). Eq. 14."""
    product = m[..., 0:1] * n[..., 3:4] + m[..., 1:2] * n[..., 0:3] + m[..., 2:3] * n_trt
    return product / np.square(np.maximum(cos_theta_d, LEAST_COS_THETA_D))[..., None]
