# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of hair whose looks vary by maps: the same tables serve all looks within a range of absorption.

A strand is lit among strands with its own look, because a map gives neighbors nearly the same look. Slices are at
fixed absorptions, so that a strand does not change while others are painted.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..fibre import strand_variation
from . import absorption_slices, albedo, lookup_tables, strand_tables

_STEP = 0.125  # of sqrt(sigma_a) between slices
_MOST = 4.0  # sqrt(sigma_a) whose transmittance is below half floats


@dataclass(frozen=True, eq=False)
class LookTables:
    """Tables over sqrt(sigma_a), and the fiber's settings without its absorption.

    dual: rows as in `dual_scattering.QUANTITIES`; returned: as in `StrandTables`; parts: fractions (K,) of uniform
    light scattered forward and backward by strands of the slices' absorption.
    """

    slices: absorption_slices.Slices
    variation: strand_variation.Settings
    dual: np.ndarray | None  # (K, 9, T, 3), of the energy-conserving mode
    returned: np.ndarray  # (32, T, 4)
    parts: tuple[np.ndarray, np.ndarray]

    @property
    def settings(self) -> lookup_tables.Settings:
        """The fiber's settings."""
        return self.slices.settings

    def mean_parts(self, sigma_a: np.ndarray, weights: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return the fractions (3,) scattered forward and backward, means over strands with sigma_a (S, ..., 3).

        weights: (S,) of the strands.
        """
        each = sigma_a.reshape(len(sigma_a), -1, 3)
        forward, backward = (
            np.average(strand_tables.at_absorptions(part, self.slices, each).mean(axis=1), axis=0, weights=weights)
            for part in self.parts
        )
        return forward, backward


def covering(least: float, greatest: float) -> tuple[float, float]:
    """Return a range (low, high) of sqrt(sigma_a), in whole steps, that covers absorptions from least to greatest."""
    low = min(math.floor(math.sqrt(least) / _STEP) * _STEP, _MOST - _STEP)
    return low, min(max(math.ceil(math.sqrt(greatest) / _STEP) * _STEP, low + _STEP), _MOST)


def variation_of(variation: strand_variation.Settings) -> strand_variation.Settings:
    """Return the part of a look's variation that its `StrandLooks` do not contain."""
    return strand_variation.Settings(
        gradient_start=variation.gradient_start,
        gradient_end=variation.gradient_end,
        random_roughness=variation.random_roughness,
    )


def bake(
    settings: lookup_tables.Settings,
    variation: strand_variation.Settings,
    covered: tuple[float, float],
    device: str = "cpu",
) -> LookTables:
    """Bake `LookTables`; covered: from `covering`; sigma_a of the `lookup_tables.Settings` is not used."""
    settings = replace(settings, size=min(settings.size, strand_tables.GREATEST_SIZE))
    low, high = covered
    count = round((high - low) / _STEP) + 1
    slices = absorption_slices.bake(settings, (low * low, high * high), count, device)
    gray = np.repeat(np.square(np.linspace(low, high, count))[:, None, None], 3, axis=2)
    dual = strand_tables.dual_among(slices, gray) if settings.mode == "energy" else None
    forward, backward = albedo.mean_parts(slices.lobes, settings)
    return LookTables(slices, variation, dual, strand_tables.returned(slices), (forward, backward))
