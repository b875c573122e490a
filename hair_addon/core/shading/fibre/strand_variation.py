# SPDX-License-Identifier: GPL-3.0-or-later
"""Variation between and along strands: absorption, and roughness (`principled.varied_roughness`).

    sigma_a = (pigment k(random) + dye) (1 + (tip_absorption - 1) g) + tip_dye g

where g rises smoothly from 0 to 1 along the strand, and k is the strand's factor of the pigment.
"""

from dataclasses import dataclass

import numpy as np

from ...params import Settings as _Settings
from ...params import param
from .angles import Values
from .pigment import LEAST_LIGHT


@dataclass(frozen=True)
class Settings(_Settings):
    """Shader inputs for a point's absorption and roughness; `appearance` derives them from the artist's settings."""

    pigment: tuple = param((0.0, 0.0, 0.0), "Absorption per radius that varies from strand to strand", low=0.0)
    dye: tuple = param((0.0, 0.0, 0.0), "Absorption per radius that all strands share", low=0.0)
    melanin: float = param(0.0, "Mean melanin, which varies; at 0 the pigment varies instead", low=0.0, high=1.0)
    random_color: float = param(0.0, "Maximum relative deviation of the pigment", low=0.0, high=1.0)
    tip_absorption: float = param(1.0, "Absorption at the tip relative to the root", low=0.0)
    tip_dye: tuple = param((0.0, 0.0, 0.0), "Additional absorption per radius at the tip", low=0.0)
    gradient_start: float = param(
        0.0, "Position along the strand where the tip color begins; 0 is the root, 1 the tip", low=0.0, high=1.0
    )
    gradient_end: float = param(
        1.0, "Position along the strand where the tip color is reached; 0 is the root, 1 the tip", low=0.0, high=1.0
    )

    random_roughness: float = param(0.0, "Maximum relative deviation of the roughness", low=0.0, high=1.0)

    @property
    def is_even(self) -> bool:
        """Whether all strands are equal from root to tip, so that tables of one sigma_a suffice."""
        return self.random_color == 0.0 and self.random_roughness == 0.0 and not self.has_gradient

    @property
    def has_gradient(self) -> bool:
        """Whether tips differ from roots."""
        return self.tip_absorption != 1.0 or any(self.tip_dye)


def strand_sigma_a(settings: Settings, random: Values, position: Values) -> np.ndarray:
    """Return sigma_a (..., 3) of strands with random numbers (...) in [0, 1], at positions (...), root 0 to tip 1."""
    gradient = tip_gradient(settings.gradient_start, settings.gradient_end, position)
    return sigma_a_along(settings, random, gradient)


def sigma_a_along(settings: Settings, random: Values, gradient: Values) -> np.ndarray:
    """Return sigma_a (..., 3) at a fraction `gradient` (...) of the tip's color."""
    pigment = pigment_factor(settings.melanin, settings.random_color, random)[..., None] * settings.pigment
    gradient = np.asarray(gradient, float)[..., None]
    at_root = pigment + np.asarray(settings.dye)
    return at_root * (1.0 + (settings.tip_absorption - 1.0) * gradient) + gradient * settings.tip_dye


def sample_sigma_a(settings: Settings, count: int = 16) -> np.ndarray:
    """Return sigma_a (count, count, 3) of strands with evenly spaced random numbers, at evenly spaced positions."""
    middles = (np.arange(count) + 0.5) / count
    return strand_sigma_a(settings, middles[:, None], middles)


def pigment_factor(melanin: float, random_color: float, random: Values) -> np.ndarray:
    """Return k (...): the factor of pigment by a strand's random number (...), as Cycles varies melanin."""
    factor = 1.0 + 2.0 * (np.asarray(random, float) - 0.5) * random_color
    if melanin < 1e-4:  # here concentration is proportional to melanin, and its logarithm is inaccurate
        return factor
    concentrations = [np.log(np.maximum(1.0 - amount, LEAST_LIGHT)) for amount in (melanin * factor, melanin)]
    return concentrations[0] / concentrations[1]


def tip_gradient(start: float, end: float, position: Values) -> np.ndarray:
    """Return g (...): a smooth step between two positions along the strand; a sharp step if they are equal."""
    x = np.clip((np.asarray(position, float) - start) / np.maximum(end - start, 1e-4), 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def absorption_range(settings: Settings) -> tuple[float, float]:
    """Return (least, greatest) sigma_a of all channels, strands and positions."""
    extremes = strand_sigma_a(settings, *np.meshgrid([0.0, 1.0], [0.0, 1.0]))
    return float(extremes.min()), float(extremes.max())
