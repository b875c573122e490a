# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's settings for the viewport's models and for Cycles, with the names and units of Principled Hair.

Defaults are also those of Principled Hair, except the pigment: it is dark blond, whose shading is visible in the light
of Blender's start-up scene.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ..errors import HairError
from ..params import Settings, param, param_of
from .fibre import kajiya_kay, marschner, strand_variation
from .fibre.fresnel import dielectric_reflectance
from .fibre.pigment import (
    FITTED_IOR,
    color_falloff,
    color_from_sigma_a,
    color_of_scattering,
    sigma_a_from_color,
    sigma_a_from_melanin,
)
from .tables import lookup_tables

_WHITE = (1.0, 1.0, 1.0)

_CACHE_SIZE = 64  # cached results of functions of looks, which are called in every step of a stroke

# The fields of `lookup_tables.Settings` that `table_settings` derives from the appearance.
TABLE_FIELDS = ("mode", "eta", "sigma_a", "tilt", "roughness", "radial_roughness", "coat", "beta_r")

# Fields of the variation along strands and between them.
STRAND_FIELDS = ("random_color", "random_roughness", "tip_absorption", "tip_tint", "gradient_start", "gradient_end")

# A film of water fills the gaps between the cuticle's scales: the surface becomes smooth (narrow highlights, no tilt),
# and the effective index of refraction lower. The pigment does not change. Water is not modeled by Coat: Cycles samples
# its Coat with one roughness and weights it with another (DECISIONS.md, Wet hair).
_WET = {"roughness": 0.14, "cuticle_angle": math.radians(0.5), "ior": 1.38}

# Fibers with the refractive index of air reflect nothing.
_LEAST_SCATTERING = 1e-6

# Fields that define the color, by parametrization.
COLOR_FIELDS = {"MELANIN": ("melanin", "redness", "tint"), "COLOR": ("color",), "ABSORPTION": ("absorption",)}


@dataclass(frozen=True)
class Appearance(Settings):
    """The look of hair."""

    mode: str = param_of(marschner.Settings, "mode", "energy")
    parametrization: str = param(
        "MELANIN",
        "Method to set the hair color",
        label="Color from",
        choices=(
            ("MELANIN", "Melanin", "Natural pigment and an optional dye"),
            ("COLOR", "Color", "Overall color of the hair"),
            ("ABSORPTION", "Absorption", "Absorption coefficient of the fiber"),
        ),
    )
    melanin: float = param(
        0.34,
        "Amount of pigment; higher values are darker: 0.2 is blond, 0.66 brown, 1 black",
        low=0.0,
        high=1.0,
        may_vary=True,
    )
    redness: float = param(
        0.3,
        "Proportion of red pigment; higher values are redder",
        label="Redness",
        low=0.0,
        high=1.0,
        may_vary=True,
    )
    tint: tuple = param(
        _WHITE,
        "Color of a dye over the melanin; white is no dye",
        low=0.0,
        high=1.0,
        subtype="COLOR",
        may_vary=True,
    )
    color: tuple = param(
        (0.017513, 0.005763, 0.002059),
        "Overall color of the hair",
        low=0.0,
        high=1.0,
        subtype="COLOR",
        may_vary=True,
    )
    absorption: tuple = param_of(marschner.Settings, "sigma_a", (0.245531, 0.52, 1.365))
    roughness: float = param_of(marschner.Settings, "roughness", may_vary=True)
    radial_roughness: float = param_of(marschner.Settings, "radial_roughness", may_vary=True)
    coat: float = param_of(marschner.Settings, "coat")
    ior: float = param_of(marschner.Settings, "eta")
    cuticle_angle: float = param_of(marschner.Settings, "tilt", math.radians(2.0))
    wetness: float = param(
        0.0,
        "Amount of water: strands gleam, and the hair darkens",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    random_color: float = param(
        0.0, "Random variation of the pigment between strands", low=0.0, high=1.0, subtype="FACTOR", may_vary=True
    )
    random_roughness: float = param(
        0.0, "Random variation of the roughness between strands", low=0.0, high=1.0, subtype="FACTOR"
    )
    tip_absorption: float = param(
        1.0,
        "Pigment at the tip relative to the root; values below 1 bleach the tips, values above 1 darken them",
        low=0.0,
        high=10.0,
        may_vary=True,
    )
    tip_tint: tuple = param(
        _WHITE,
        "Color of a dye at the tip; white is no dye",
        low=0.0,
        high=1.0,
        subtype="COLOR",
        may_vary=True,
    )
    gradient_start: float = param(
        0.3,
        "Position along the strand where the tip color begins; 0 is the root, 1 the tip",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    gradient_end: float = param(
        1.0,
        "Position along the strand where the tip color is reached; 0 is the root, 1 the tip",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )


def shown_changes(changes: dict[str, Any], name_of: Callable[[str], str] = str) -> dict[str, Any]:
    """Return changes of an `Appearance`, with the parametrization that a color among them needs.

    name_of: a field's name in messages. Raises `HairError` for a color that the parametrization would not use.
    """
    given = {name: kind for kind, names in COLOR_FIELDS.items() for name in names if name in changes}
    kinds = set(given.values())
    if "parametrization" in changes:
        kind = changes["parametrization"]
        unseen = [name_of(name) for name, its in given.items() if its != kind]
        if unseen and kind in COLOR_FIELDS:
            raise HairError(f"{' and '.join(unseen)} would change nothing: the color follows from {kind}.")
        return changes
    if len(kinds) > 1:
        names = " and ".join(map(name_of, given))
        raise HairError(f"{names} exclude each other: the color follows from one of {', '.join(COLOR_FIELDS)}.")
    return changes | ({"parametrization": kinds.pop()} if kinds else {})


@lru_cache(maxsize=_CACHE_SIZE)
def wetted(look: Appearance, wetness: float) -> Appearance:
    """Return the dry look that represents a look at a wetness from 0 to 1, linear between dry and soaked hair."""
    if wetness == 0.0:
        return replace(look, wetness=0.0)
    dry = {name: getattr(look, name) for name in _WET}
    mixed = {name: (1.0 - wetness) * dry[name] + wetness * wet for name, wet in _WET.items()}
    return replace(look, wetness=0.0, **mixed)


# A smaller share of a look is invisible.
_LEAST_SHARE = 1.0 / 1024.0


def wet_share(wetness: np.ndarray, least: float, most: float) -> np.ndarray:
    """Return (S,) float32 in [0, 1]: the share of the wettest look in a mix with the driest look, for strands with
    wetness (S,).

    least, most: wetness of both looks, least < most.
    """
    share = np.clip((np.asarray(wetness, np.float32) - np.float32(least)) / np.float32(most - least), 0.0, 1.0)
    share[share < _LEAST_SHARE] = 0.0
    share[share > 1.0 - _LEAST_SHARE] = 1.0
    return share


def shaded(look: Appearance) -> Appearance:
    """Return the dry look of a look that may be wet, from which every model is derived."""
    return wetted(look, look.wetness)


def sigma_a(appearance: Appearance) -> tuple[float, ...]:
    """Return the absorption per radius, RGB, of an average strand at its root."""
    strands = strand_settings(appearance)
    return tuple(float(pigment + dye) for pigment, dye in zip(strands.pigment, strands.dye, strict=True))


def mean_color(appearance: Appearance) -> np.ndarray:
    """Return the color of a full head of this hair, RGB (3,), the mean over all strands from root to tip.

    Fibers reflect R and TRT, both in proportion to the reflectance of their surface, which water lowers.
    """
    sigma_a_everywhere = strand_variation.sample_sigma_a(strand_settings(appearance))
    color = color_from_sigma_a(sigma_a_everywhere, appearance.radial_roughness).reshape(-1, 3).mean(axis=0)
    return dimmed(color, appearance)


def dimmed(color: np.ndarray, appearance: Appearance) -> np.ndarray:
    """Return the color (3,) of hair with the reflectance of a look's fibers; color: (3,) of hair with dry fibers."""
    scattering = _mean_reflectance(shaded(appearance).ior) / _mean_reflectance(FITTED_IOR)
    return color_of_scattering(color, max(scattering, _LEAST_SCATTERING))


@lru_cache(maxsize=_CACHE_SIZE)
def strand_settings(appearance: Appearance) -> strand_variation.Settings:
    """Return the `strand_variation.Settings`: variation of the absorption between strands and along them."""
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
    """Return (pigment (3,), dye (3,), melanin; 0 for other parametrizations)."""
    if appearance.parametrization == "ABSORPTION":
        return appearance.absorption, (0.0, 0.0, 0.0), 0.0
    if appearance.parametrization == "COLOR":
        return sigma_a_from_color(appearance.color, appearance.radial_roughness), (0.0, 0.0, 0.0), 0.0
    pigment = sigma_a_from_melanin(appearance.melanin, appearance.redness)
    return pigment, _dye(appearance.tint, appearance.radial_roughness), appearance.melanin


def _dye(tint, radial_roughness):
    """Return sigma_a of a dye; zero for white, although the fit absorbs some light there."""
    return tuple(
        0.0 if component >= 1.0 else float(sigma_a_from_color(component, radial_roughness)) for component in tint
    )


@lru_cache(maxsize=_CACHE_SIZE)
def table_settings(appearance: Appearance, base: lookup_tables.Settings | None = None) -> lookup_tables.Settings:
    """Return the `lookup_tables.Settings` of an average strand at its root.

    base: provides the other settings: size and axes of the tables, shifts, glints of the classic mode.
    """
    appearance = shaded(appearance)
    return replace(
        base or lookup_tables.Settings(),
        mode=appearance.mode,
        eta=appearance.ior,
        sigma_a=sigma_a(appearance),
        tilt=appearance.cuticle_angle,
        roughness=appearance.roughness,
        radial_roughness=appearance.radial_roughness,
        coat=appearance.coat,
        beta_r=float(marschner.beta_r_of(appearance.roughness)),
    )


_NEUTRAL_COLOR = (0.5, 0.5, 0.5)  # a ball of hair of this color is as bright as a white surface in even light


@lru_cache(maxsize=_CACHE_SIZE)
def neutral(look: Appearance) -> Appearance:
    """Return a look for tinting: all strands are the same bright gray, with the highlights of the given look."""
    shading = {name: getattr(look, name) for name in ("roughness", "radial_roughness", "coat", "ior", "cuticle_angle")}
    return Appearance(parametrization="COLOR", color=_NEUTRAL_COLOR, **shading)


def kajiya_kay_settings(appearance: Appearance) -> kajiya_kay.Settings:
    """Return the `kajiya_kay.Settings`: the groom's color, and a highlight with R's width and R's energy."""
    appearance = shaded(appearance)
    exponent = float(kajiya_kay.highlight_exponent((1.0 - appearance.coat) * appearance.roughness))
    peak = float(kajiya_kay.highlight_peak(_mean_reflectance(appearance.ior), exponent))
    color = color_from_sigma_a(np.array(sigma_a(appearance)), appearance.radial_roughness)
    return kajiya_kay.Settings(tuple(map(float, color)), (peak,) * 3, exponent)


def kajiya_kay_strand_settings(appearance: Appearance) -> kajiya_kay.StrandSettings:
    """Return the `kajiya_kay.StrandSettings` for strands with variation."""
    appearance = shaded(appearance)
    return kajiya_kay.StrandSettings(
        falloff=float(color_falloff(appearance.radial_roughness)),
        reflectance=_mean_reflectance(appearance.ior),
        roughness=appearance.roughness,
        coat=appearance.coat,
    )


@lru_cache(maxsize=_CACHE_SIZE)
def _mean_reflectance(eta):
    """Return the directional albedo of a fiber's surface under uniform light."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    theta, gamma = 0.25 * np.pi * (1.0 + nodes)[:, None], 0.25 * np.pi * (1.0 + nodes)[None, :]
    # Weights cos(theta) of directions and cos(gamma) of offsets across the width: both quadratures sum to one.
    measure = np.outer(weights, weights) * np.cos(theta) * np.cos(gamma)
    return float(np.average(dielectric_reflectance(np.cos(theta) * np.cos(gamma), eta), weights=measure))


def principled_sockets(appearance: Appearance) -> dict[str, Any]:
    """Return {socket: value} for Principled Hair: model Chiang, parametrization Absorption.

    The absorption is that of an average strand at its root; `strand_settings` has the variation.
    """
    appearance = shaded(appearance)
    return {
        "Absorption Coefficient": sigma_a(appearance),
        "Roughness": appearance.roughness,
        "Radial Roughness": appearance.radial_roughness,
        "Coat": appearance.coat,
        "IOR": appearance.ior,
        "Offset": appearance.cuticle_angle,
        "Random Roughness": appearance.random_roughness,
    }
