# SPDX-License-Identifier: GPL-3.0-or-later
"""Bending of a guide under its weight, as an illustration of its settings before a simulation.

The shape of a level cantilever of length L depends on a single number,

    Γ = ρ A g L³ / EI        EI = k E π r⁴ / 4,    A = π r²

its weight relative to its stiffness. For small Γ the tip sinks by Γ L / 8, for large Γ the guide hangs from its root.
"""

import functools
import math

import numpy as np

from .material import LEAST_STIFFNESS, WET_SOFTNESS, WET_WEIGHT
from .settings import DynamicsSettings

_SEGMENT_COUNT = 32  # within 0.2 % of the elastica up to Γ = 60
_MOST_STEPS = 50


def weight_ratio(settings: DynamicsSettings, length: float, gravity: float) -> float:
    """Return Γ of a guide with a length [m] in gravity [m/s²], with the stiffness of its root."""
    radius = settings.fibre_radius
    weight = settings.weight * (1.0 + WET_WEIGHT * settings.wetness) * settings.density * math.pi * radius**2 * gravity
    softness = 1.0 - WET_SOFTNESS * settings.wetness
    stiffness = settings.bend_stiffness * softness * settings.youngs_modulus * 1e9 * math.pi * radius**4 / 4.0
    return weight * length**3 / stiffness


def bend_under_weight(settings: DynamicsSettings, length: float, gravity: float) -> float:
    """Return the sag [m] of the tip of a straight guide that is clamped horizontally; length [m], gravity [m/s²]."""
    return length * tip_sink(weight_ratio(settings, length, abs(gravity)), settings.tip_stiffness)


@functools.lru_cache(maxsize=64)
def tip_sink(ratio: float, tip_stiffness: float = 1.0) -> float:
    """Return the sag of a level cantilever's tip relative to its length; ratio: Γ; tip_stiffness: relative to the root.

    Segments at angles θ below the horizontal minimize ½ ∫ EI θ'² − ∫ (weight beyond) sin θ. The energy is convex
    between horizontal and vertical, so Newton's method finds the unique minimum.
    """
    count = _SEGMENT_COUNT
    joints = np.arange(count) / count
    joints[0] = 0.25 / count  # the center of the half segment at the clamp
    stiffness = count * np.maximum(1.0 + (tip_stiffness - 1.0) * joints, LEAST_STIFFNESS)
    stiffness[0] *= 2.0
    load = ratio * (1.0 - (np.arange(count) + 0.5) / count) / count
    bending = (
        np.diag(stiffness + np.append(stiffness[1:], 0.0)) - np.diag(stiffness[1:], 1) - np.diag(stiffness[1:], -1)
    )
    angles = np.minimum(np.linalg.solve(bending, load), math.pi / 2.0)
    for _ in range(_MOST_STEPS):
        slope = bending @ angles - load * np.cos(angles)
        step = np.linalg.solve(bending + np.diag(load * np.sin(angles)), slope)
        angles = np.clip(angles - step, 0.0, math.pi / 2.0)
        if np.abs(step).max() < 1e-6:
            break
    return float(np.sin(angles).mean())
