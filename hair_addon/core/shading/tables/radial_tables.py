# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of hair whose radial roughness varies by a map: layers of `look_tables` at evenly spaced radial roughness.

Layers have fixed values, so that a strand does not change while others are painted. Values between layers are
interpolated linearly, which conserves energy.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...params import Settings as _Settings
from ...params import param
from ..fibre import strand_variation
from . import absorption_slices, look_tables, lookup_tables
from .look_tables import LookTables

_STEP = 0.0625  # of the radial roughness between layers


@dataclass(frozen=True)
class Layers(_Settings):
    """Radial roughness of the layers."""

    low: float = param(0.0, "Radial roughness of the first layer", low=0.0, high=1.0)
    step: float = param(_STEP, "Radial roughness between layers", low=0.0, high=1.0)
    count: float = param(2.0, "Number of layers", low=2.0)


@dataclass(frozen=True, eq=False)
class RadialTables:
    """`LookTables` of one range of absorption, at each layer's radial roughness."""

    tables: tuple[LookTables, ...]
    layers: Layers

    @property
    def slices(self) -> absorption_slices.Slices:
        """`Slices` of the first layer, which has the range and the settings of all."""
        return self.tables[0].slices

    @property
    def variation(self) -> strand_variation.Settings:
        """The variation of the looks."""
        return self.tables[0].variation

    @property
    def settings(self) -> lookup_tables.Settings:
        """The fiber's settings, with the radial roughness of the first layer."""
        return self.tables[0].settings

    def mean_parts(self, sigma_a: np.ndarray, radial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the fractions (3,) scattered forward and backward, means over strands.

        sigma_a: (S, ..., 3); radial: (S,) radial roughness.
        """
        below, fraction = layer_of(self.layers, radial)
        total = np.zeros((2, 3))
        for index, tables in enumerate(self.tables):
            share = (1.0 - fraction) * (below == index) + fraction * (below + 1 == index)
            if share.any():
                total += share.mean() * np.stack(tables.mean_parts(sigma_a, share))
        forward, backward = total
        return forward, backward


def layer_of(layers: Layers, radial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the layer below radial roughness (...), and the fraction (...) of the distance to the next layer."""
    place = (np.asarray(radial, float) - layers.low) / layers.step
    below = np.clip(np.floor(place), 0, layers.count - 2).astype(int)
    return below, np.clip(place - below, 0.0, 1.0)


def covering(least: float, greatest: float) -> Layers:
    """Return the `Layers` that cover radial roughness from least to greatest."""
    low = min(math.floor(least / _STEP) * _STEP, 1.0 - _STEP)
    high = min(max(math.ceil(greatest / _STEP) * _STEP, low + _STEP), 1.0)
    return Layers(low, _STEP, round((high - low) / _STEP) + 1.0)


def values_of(layers: Layers) -> list[float]:
    """Return the radial roughness of each layer."""
    return [float(value) for value in layers.low + layers.step * np.arange(round(layers.count))]


def bake(
    settings: lookup_tables.Settings,
    variation: strand_variation.Settings,
    covered: tuple[float, float],
    layers: Layers,
    device: str = "cpu",
) -> RadialTables:
    """Bake `RadialTables`; arguments as for `look_tables.bake`; the radial roughness of the settings has no effect."""
    every = (replace(settings, radial_roughness=each) for each in values_of(layers))
    return RadialTables(tuple(look_tables.bake(each, variation, covered, device) for each in every), layers)
