# SPDX-License-Identifier: GPL-3.0-or-later
"""What artists set, once, for the viewport's models and for Cycles: names, units and defaults are Principled Hair's."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..params import Settings, param
from . import kajiya_kay, lookup_tables, strand_variation
from .fresnel import dielectric_reflectance
from .marschner import beta_r_of
from .pigment import color_falloff, color_from_sigma_a, sigma_a_from_color, sigma_a_from_melanin

_WHITE = (1.0, 1.0, 1.0)

# What `table_settings` takes from the appearance, of the fields of `lookup_tables.Settings`.
TABLE_FIELDS = ("mode", "eta", "sigma_a", "tilt", "roughness", "radial_roughness", "coat", "beta_r")

# What differs along strands and between them.
STRAND_FIELDS = ("random_color", "random_roughness", "tip_absorption", "tip_tint", "gradient_start", "gradient_end")

# What the colour follows from, by parametrization.
COLOR_FIELDS = {"MELANIN": ("melanin", "redness", "tint"), "COLOR": ("color",), "ABSORPTION": ("absorption",)}


@dataclass(frozen=True)
class Appearance(Settings):
    """The look of hair."""

    mode: str = param(
        "energy",
        "Which of Marschner's models the viewport draws",
        label="Model",
        choices=(
            ("energy", "Energy Conserving", "A rough fibre that loses nothing, as Cycles has it [Chiang16]"),
            ("classic", "Classic", "Gaussian lobes of a smooth fibre, with glints [Marschner03]"),
        ),
    )
    parametrization: str = param(
        "MELANIN",
        "What the colour of hair follows from",
        label="Color from",
        choices=(
            ("MELANIN", "Melanin", "Amount and kind of natural pigment, and a dye"),
            ("COLOR", "Color", "The colour of a full head of hair"),
            ("ABSORPTION", "Absorption", "What the fibre absorbs per radius"),
        ),
    )
    melanin: float = param(0.8, "Amount of pigment: 0.2 is blond, 0.66 brown, 1 black", low=0.0, high=1.0)
    redness: float = param(1.0, "Part of the pigment that is red", label="Redness", low=0.0, high=1.0)
    tint: tuple = param(_WHITE, "Colour of a dye over the melanin", low=0.0, high=1.0, subtype="COLOR")
    color: tuple = param(
        (0.017513, 0.005763, 0.002059), "Colour of a full head of hair", low=0.0, high=1.0, subtype="COLOR"
    )
    absorption: tuple = param(
        (0.245531, 0.52, 1.365), "Absorption of red, green and blue light per fibre radius", low=0.0, high=1000.0
    )
    roughness: float = param(0.3, "Spread of highlights along the fibre", low=0.0, high=1.0, subtype="FACTOR")
    radial_roughness: float = param(0.3, "Spread of light around the fibre", low=0.0, high=1.0, subtype="FACTOR")
    coat: float = param(
        0.0, "How much sharper the first highlight is than the others", low=0.0, high=1.0, subtype="FACTOR"
    )
    ior: float = param(1.55, "Refractive index of the fibre", label="IOR", low=1.01, high=3.0, soft_high=2.0)
    cuticle_angle: float = param(
        math.radians(2.0),
        "Tilt of the cuticle's scales, which moves the highlights apart",
        low=math.radians(-20.0),
        high=math.radians(20.0),
        unit="ROTATION",
        subtype="ANGLE",
    )
    random_color: float = param(
        0.0, "How much pigment differs from strand to strand", low=0.0, high=1.0, subtype="FACTOR"
    )
    random_roughness: float = param(
        0.0, "How much roughness differs from strand to strand", low=0.0, high=1.0, subtype="FACTOR"
    )
    tip_absorption: float = param(
        1.0, "Pigment at the tip, relative to the root: below 1 bleached, above 1 darker", low=0.0, high=10.0
    )
    tip_tint: tuple = param(_WHITE, "Colour of a dye at the tip", low=0.0, high=1.0, subtype="COLOR")
    gradient_start: float = param(
        0.3, "Part of the length at which the tip's colour begins", low=0.0, high=1.0, subtype="FACTOR"
    )
    gradient_end: float = param(
        1.0, "Part of the length at which the tip's colour is reached", low=0.0, high=1.0, subtype="FACTOR"
    )


def sigma_a(appearance):
    """Absorption per radius, RGB, of an average strand at its root."""
    strands = strand_settings(appearance)
    return tuple(float(pigment + dye) for pigment, dye in zip(strands.pigment, strands.dye, strict=True))


def mean_color(appearance):
    """The colour of a full head of this hair, RGB (3,), the mean over all strands from root to tip."""
    sigma_a_everywhere = strand_variation.sample_sigma_a(strand_settings(appearance))
    return color_from_sigma_a(sigma_a_everywhere, appearance.radial_roughness).reshape(-1, 3).mean(axis=0)


def strand_settings(appearance):
    """`Appearance` → `strand_variation.Settings`: absorption from strand to strand and along each."""
    pigment, dye, melanin = _absorption(appearance)
    return strand_variation.Settings(
        pigment=tuple(map(float, pigment)),
        dye=tuple(map(float, dye)),
        melanin=melanin,
        random_color=appearance.random_color,
        tip_absorption=appearance.tip_absorption,
        tip_dye=_dye(appearance.tip_tint, appearance.radial_roughness),
        gradient_start=min(appearance.gradient_start, appearance.gradient_end),
        gradient_end=appearance.gradient_end,
        random_roughness=appearance.random_roughness,
    )


def _absorption(appearance):
    """(pigment (3,), dye (3,), melanin or 0 where pigment doesn't follow from melanin)."""
    if appearance.parametrization == "ABSORPTION":
        return appearance.absorption, (0.0, 0.0, 0.0), 0.0
    if appearance.parametrization == "COLOR":
        return sigma_a_from_color(appearance.color, appearance.radial_roughness), (0.0, 0.0, 0.0), 0.0
    pigment = sigma_a_from_melanin(appearance.melanin, appearance.redness)
    return pigment, _dye(appearance.tint, appearance.radial_roughness), appearance.melanin


def _dye(tint, radial_roughness):
    """sigma_a of a dye; white is none, though the fit never lets light through whole."""
    return tuple(
        0.0 if component >= 1.0 else float(sigma_a_from_color(component, radial_roughness)) for component in tint
    )


def table_settings(appearance, base=None):
    """`Appearance` → `lookup_tables.Settings` of an average strand at its root.

    base: settings that the rest is taken from: size and axes of the tables, shifts, glints of the classic mode.
    """
    return replace(
        base or lookup_tables.Settings(),
        mode=appearance.mode,
        eta=appearance.ior,
        sigma_a=sigma_a(appearance),
        tilt=appearance.cuticle_angle,
        roughness=appearance.roughness,
        radial_roughness=appearance.radial_roughness,
        coat=appearance.coat,
        beta_r=float(beta_r_of(appearance.roughness)),
    )


def kajiya_kay_settings(appearance):
    """`Appearance` → `kajiya_kay.Settings`: the groom's colour, and a highlight with R's width and R's energy."""
    exponent = float(kajiya_kay.highlight_exponent((1.0 - appearance.coat) * appearance.roughness))
    peak = float(kajiya_kay.highlight_peak(_mean_reflectance(appearance.ior), exponent))
    color = color_from_sigma_a(np.array(sigma_a(appearance)), appearance.radial_roughness)
    return kajiya_kay.Settings(tuple(map(float, color)), (peak,) * 3, exponent)


def kajiya_kay_strand_settings(appearance):
    """`Appearance` → `kajiya_kay.StrandSettings`: the same for strands that differ."""
    return kajiya_kay.StrandSettings(
        falloff=float(color_falloff(appearance.radial_roughness)),
        reflectance=_mean_reflectance(appearance.ior),
        roughness=appearance.roughness,
        coat=appearance.coat,
    )


def _mean_reflectance(eta):
    """What the surface of a fibre reflects of light from everywhere."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    theta, gamma = 0.25 * np.pi * (1.0 + nodes)[:, None], 0.25 * np.pi * (1.0 + nodes)[None, :]
    # Of directions cos(theta), of offsets in the width cos(gamma): both quadratures sum to one.
    measure = np.outer(weights, weights) * np.cos(theta) * np.cos(gamma)
    return float(np.average(dielectric_reflectance(np.cos(theta) * np.cos(gamma), eta), weights=measure))


def principled_sockets(appearance):
    """`Appearance` → {socket: value} of Principled Hair: model Chiang, parametrization Absorption.

    The absorption is that of an average strand at its root; `strand_settings` says how the others differ.
    """
    return {
        "Absorption Coefficient": sigma_a(appearance),
        "Roughness": appearance.roughness,
        "Radial Roughness": appearance.radial_roughness,
        "Coat": appearance.coat,
        "IOR": appearance.ior,
        "Offset": appearance.cuticle_angle,
        "Random Roughness": appearance.random_roughness,
    }
