# SPDX-License-Identifier: GPL-3.0-or-later
"""Curl: strands wind around their former path, as helices or flat waves.

With h = pitch (1 + pitch_vary (2 h_pitch - 1)) of a lock, the arc of a turn ℓ = sqrt((2πR)² + h²), κ = keep_length and
y the strand's progress along its path:

    R_i = A_si · radius · smoothstep(2 s_i / ℓ),    h_i = h · (1 + stretch (1 - x_i))
    φ_i = φ_(i-1) + 2π d_i ((1 - κ) / h_i + κ / sqrt((2πR)² (1 + (1 - flatness)²) / 2 + h_i²))
                  + (2π Σ (y_j - y_(j-1)) / h_j - φ_(i-1)) h_i² / ((2πR)² (1 + (1 - flatness)²) / 2 + h_i²)
    φ_0 = 2π (h_clump + (1 - coherence) (h_s - ½)),    ρ_i = R_i (cos φ_i, ± (1 - flatness) sin φ_i)

The second line corrects the phase to one turn per pitch of y. Below a Clump, y is measured along the center of the
strand's lock, and ρ is in the center's frames, so that strands with different roots wind together (beside.strand).
Without a Clump, y is the strand's own.

A straight strand of length L reaches L h / ℓ. It becomes the curve of curvature R / (R² + (h/2π)²) and torsion
(h/2π) / (R² + (h/2π)²), the helix that natural curvature gives a fiber [Bertails06]. A twentieth of the locks, between
left and right, is flat, so that the fraction of left-handed locks can be animated. In coils whose handedness changes
along the strand (switchbacks, or perversions), φ reverses where a one-dimensional noise of the lock changes sign.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..params import param, param_of
from .base import Cutter, ProfiledSettings, Step, step_of

LABEL = "Curl"
DESCRIPTION = "Wind strands into coils or waves"
STEP = "CURL"
SHARED_BY_LOCKS = True
NUMBERS = (
    "radius",
    "pitch",
    "pitch_vary",
    "roundness",
    "coherence",
    "stretch",
    "left_handed",
    "switchback",
)  # of curl.strand
COURSES = ("amount", "radius", "pitch", "flatness")

POINTS_A_TURN = 8  # with fewer, coils look angular


@dataclass(frozen=True)
class Settings(ProfiledSettings):
    """Size and course of coils."""

    radius: float = param(
        0.006,
        "Radius of the coils",
        low=0.0,
        high=1e3,
        soft_high=0.05,
        unit="LENGTH",
        subtype="DISTANCE",
        precision=4,
        may_vary=True,
        has_course=True,
    )
    pitch: float = param(
        0.03,
        "Distance along the strand's path between two turns",
        low=1e-4,
        high=1e4,
        soft_high=0.2,
        unit="LENGTH",
        subtype="DISTANCE",
        precision=4,
        may_vary=True,
        has_course=True,
    )
    pitch_vary: float = param(
        0.0,
        "Largest difference of a lock's pitch, as a part of the pitch: neighboring locks do not stay in step",
        label="Pitch variation",
        low=0.0,
        high=0.9,
        subtype="FACTOR",
        may_vary=True,
    )
    flatness: float = param(
        0.0,
        "Flatten coils into waves: 0 is a round coil, 1 a flat wave",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
        has_course=True,
    )
    coherence: float = param(
        0.85,
        "How alike the strands of a lock curl; at 0 each has a phase of its own",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    stretch: float = param(0.0, "Lengthen the coils near the roots by this factor", low=0.0, high=4.0, may_vary=True)
    left_handed: float = param(
        0.5,
        "Part of the locks that winds to the left",
        label="Left-handed",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    switchback: float = param(
        0.0,
        "Distance along the strand between changes of handedness, as in coily hair; 0 is none",
        low=0.0,
        high=1e3,
        soft_high=0.2,
        unit="LENGTH",
        subtype="DISTANCE",
        may_vary=True,
    )
    keep_length: float = param(
        1.0,
        "Preserve the length of strands, so that curls shorten the hair; at 0 the hair reaches as far as before",
        label="Preserve length",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    root: float = param_of(ProfiledSettings, "root", 0.4)
    shape: float = param_of(ProfiledSettings, "shape", 0.4)
    start: float = param_of(ProfiledSettings, "start", 0.02)


WAVE = {"flatness": 1.0, "coherence": 0.9, "pitch_vary": 0.3}  # as added from the menu under the name Wave


def turn_length(settings: Settings) -> float:
    """Return the length [m] of strand in one turn at full strength."""
    radius = 2.0 * math.pi * settings.radius * settings.amount
    return math.sqrt(radius**2 * (1.0 + (1.0 - settings.flatness) ** 2) / 2.0 + settings.pitch**2)


def points_wanted(settings: Settings, length: float) -> int:
    """Return the number of points that a strand of a length [m] needs for smooth coils, even in the tightest locks."""
    tightest = replace(settings, pitch=settings.pitch * (1.0 - settings.pitch_vary))
    return math.ceil(POINTS_A_TURN * length / turn_length(tightest)) + 1


def steps(settings: Settings, _cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps that wind strands."""
    numbers = {name: getattr(settings, name) for name in NUMBERS if name != "roundness"}
    numbers["roundness"] = 1.0 - settings.flatness
    return [step_of(settings, STEP, numbers, keep_length=settings.keep_length)]
