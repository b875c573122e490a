# SPDX-License-Identifier: GPL-3.0-or-later
"""Material of strands: masses, inertias, compliances and drag of each point and segment, from settings.

With the radius r of a fiber of length L, its section A = π r², stiffness k and lengths l_j of segments:

    EI = k E π r⁴ / 4,    GJ = k G π r⁴ / 2,    EA = E A
    m_i = ρ A (l_(i-1) + l_i) / 2,    I_j = ρ A l_j³ / 12
    b_0 = l_0 / 2,    b_j = (l_(j-1) + l_j) / 2                             length of strand that joint j bends

A guide represents a wisp of n fibers; n scales weight and stiffness alike and cancels, and k describes how much fibers
stick together. Wet hair weighs 1.3 times as much, and swollen fibers have half the stiffness of dry fibers [Robbins12].

Drag of a cylinder in air perpendicular to its axis, per length [N s/m²], with Re = 2 r |v| / ν [White06]:

    c_n = max(4πμ / (ln(2 L / r) + ½), ½ ρ_air 2 r |v| (1 + 10 Re^-⅔)),    c_t = c_n / 2
"""

import math
from dataclasses import dataclass

import numpy as np

from ...errors import HairError
from ...kernels.checks import require_count
from .settings import DynamicsSettings

AIR_DENSITY = 1.2  # [kg/m³]
AIR_VISCOSITY = 1.81e-5  # μ [Pa s]
LEAST_STIFFNESS = 1e-3  # of a tip relative to the root: the angle of a joint without stiffness is undefined

WET_WEIGHT, WET_SOFTNESS, WET_DRAG = 0.3, 0.5, 0.7  # increase of weight, decrease of stiffness and of drag at wetness 1


@dataclass(frozen=True)
class Material:
    """Material of S strands of M segments, float64, in SI units."""

    lengths: np.ndarray  # (S, M) [m]
    masses: np.ndarray  # (S, M+1) [kg]
    inertias: np.ndarray  # (S, M) [kg m²]
    bend_compliances: np.ndarray  # (S, M) b / EI [1/(N m)]
    twist_ratio: float  # EI / GJ
    stretch_compliances: np.ndarray  # (S, M) 1 / (EA l) [1/(N m)]
    slow_drags: np.ndarray  # (S,) c_n / ρA of slow air [1/s]
    drag_squares: np.ndarray  # (S,) c_n / ρA per speed [1/m]
    drag_roots: np.ndarray  # (S,) c_n / ρA per cube root of speed
    damping_time: float  # [s]


def material_of(
    settings: DynamicsSettings,
    lengths: np.ndarray,
    wetness: np.ndarray | None = None,
    stiffness: np.ndarray | None = None,
) -> Material:
    """Return the `Material` of strands with lengths (S, M) [m] of segments in the groom, root to tip.

    wetness: (S,) of each strand in [0, 1], None for the wetness of the settings; stiffness: (S,) positive bend
    stiffness of each strand, None for that of the settings. Raises `HairError` for segments of zero length.
    """
    lengths = np.asarray(lengths, np.float64)
    if not (np.isfinite(lengths).all() and (lengths > 0.0).all()):
        raise HairError("Simulated strands have segments without length.")
    wet = np.full(len(lengths), settings.wetness) if wetness is None else np.asarray(wetness, np.float64)
    require_count("wetness", len(wet), len(lengths))
    if stiffness is not None:
        require_count("stiffnesses", len(stiffness), len(lengths))
    radius = settings.fibre_radius
    section = math.pi * radius**2
    softness = 1.0 - WET_SOFTNESS * wet
    stiff = settings.bend_stiffness if stiffness is None else np.asarray(stiffness, np.float64)
    bend = stiff * softness * settings.youngs_modulus * 1e9 * math.pi * radius**4 / 4.0
    twist_ratio = settings.youngs_modulus / (2.0 * settings.twist_stiffness * settings.shear_modulus)
    stretch = settings.stretch_stiffness * softness * settings.youngs_modulus * 1e9 * section
    line_mass = settings.weight * (1.0 + WET_WEIGHT * wet) * settings.density * section  # ρA [kg/m]
    joints = np.concatenate([lengths[:, :1] / 2.0, (lengths[:, :-1] + lengths[:, 1:]) / 2.0], axis=1)
    drag = settings.air_drag * (1.0 - WET_DRAG * wet) / line_mass
    whole = lengths.sum(axis=1)
    kinematic = AIR_VISCOSITY / AIR_DENSITY
    slow = 4.0 * math.pi * AIR_VISCOSITY / np.maximum(np.log(2.0 * whole / radius) + 0.5, 1.0)
    return Material(
        lengths,
        line_mass[:, None] * _point_lengths(lengths),
        line_mass[:, None] * lengths**3 / 12.0,
        joints / (bend[:, None] * _profile(lengths, settings.tip_stiffness)),
        twist_ratio,
        1.0 / (stretch[:, None] * lengths),
        drag * slow,
        drag * AIR_DENSITY * radius,
        drag * 10.0 * AIR_DENSITY * radius * (kinematic / (2.0 * radius)) ** (2.0 / 3.0),
        settings.damping,
    )


def _point_lengths(lengths):
    """Return (S, M+1) [m]: half the total length of the segments at each point."""
    halves = np.zeros((len(lengths), lengths.shape[1] + 1))
    halves[:, :-1] += lengths / 2.0
    halves[:, 1:] += lengths / 2.0
    return halves


def _profile(lengths, tip):
    """Return the stiffness (S, M) of each joint relative to the root, linear along the strand."""
    whole = lengths.sum(axis=1, keepdims=True)
    along = (np.cumsum(lengths, axis=1) - lengths) / np.where(whole > 0.0, whole, 1.0)
    return np.maximum(1.0 + (tip - 1.0) * along, LEAST_STIFFNESS)
