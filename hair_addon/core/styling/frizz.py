# SPDX-License-Identifier: GPL-3.0-or-later
"""Frizz: strands depart from their path by band-limited noise, six waves per octave with alternating handedness.

    f_m = 2^((m + ½)/6 - ½) · 2^octave / wavelength,    g_m = gain^octave
    ρ_i = A_si · amplitude · (½ Σ g²)^(-½) Σ_m g_m c_m (cos θ_m, ± sin θ_m)
    θ_m = 2π f_m s_i + (1 - coherence) 2π h_sm + coherence k_m · X_s

X_s is the root at rest in the surface's axes and |k_m| about 2π / spread. c_m fades out waves that the strand's points
cannot carry.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..params import param
from .base import Cutter, ProfiledSettings, Step, of_each, step_of

LABEL = "Frizz"
DESCRIPTION = "Ruffle strands by smooth noise"

WAVES_AN_OCTAVE = 6
MOST_OCTAVES = 4
STEP = "FRIZZ"
# Of frizz.strand.
NUMBERS = (
    "amplitude",
    "wavelength",
    "octave_count",
    "gain",
    "coherence",
    "per_spread",
    "stray",
    "stray_gain",
    f"frequencies[{WAVES_AN_OCTAVE}]",
)
COURSES = ("amount", "amplitude", "wavelength")


@dataclass(frozen=True)
class Settings(ProfiledSettings):
    """Size and course of the noise."""

    amplitude: float = param(
        0.003,
        "Size of the noise: root mean square of the distance in each direction across the strand",
        low=0.0,
        high=1e3,
        soft_high=0.02,
        unit="LENGTH",
        subtype="DISTANCE",
        precision=4,
        may_vary=True,
        has_course=True,
    )
    wavelength: float = param(
        0.03,
        "Length of the longest waves along a strand; to animate frizz, key the amount",
        above=0.0,
        high=1e4,
        soft_high=0.2,
        unit="LENGTH",
        subtype="DISTANCE",
        precision=4,
        may_vary=True,
        has_course=True,
    )
    octaves: int = param(
        2,
        "Number of octaves of noise; each has half the wavelength of the previous octave. "
        "A map cannot vary a whole number",
        low=1,
        high=MOST_OCTAVES,
    )
    gain: float = param(
        0.5,
        "Amplitude of each octave as a fraction of the previous octave's amplitude",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    coherence: float = param(
        0.0,
        "How alike neighboring strands move; at 0 each has noise of its own",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    spread: float = param(
        0.02,
        "Distance over which coherent noise changes",
        above=0.0,
        high=1e4,
        soft_high=0.2,
        unit="LENGTH",
        subtype="DISTANCE",
        may_vary=True,
    )
    stray: float = param(0.03, "Part of the strands that fly away", low=0.0, high=1.0, subtype="FACTOR", may_vary=True)
    stray_gain: float = param(
        3.0, "Amplitude of strands that fly away, as a multiple of the others'", low=0.0, high=20.0, may_vary=True
    )
    keep_length: float = param(
        1.0,
        "Preserve the length of strands, so that frizz shortens the hair; at 0 the hair reaches as far as before",
        label="Preserve length",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )


def steps(settings: Settings, _cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps that ruffle strands."""
    per_size = of_each(lambda gain: _per_size(gain, settings.octaves), settings.gain)
    wave = np.arange(WAVES_AN_OCTAVE)
    numbers = {
        "amplitude": settings.amplitude * per_size,
        "wavelength": settings.wavelength,
        "octave_count": float(settings.octaves),
        "gain": settings.gain,
        "coherence": settings.coherence,
        "per_spread": 1.0 / settings.spread,
        "stray": settings.stray,
        "stray_gain": settings.stray_gain,
        "frequencies": tuple(2.0 ** ((wave + 0.5) / WAVES_AN_OCTAVE - 0.5)),
    }
    return [step_of(settings, STEP, numbers, keep_length=settings.keep_length)]


def _per_size(gain, octaves):
    """Return the factor that makes the root mean square of each coordinate of ρ equal the amplitude."""
    gains = gain ** np.arange(octaves)
    return (0.5 * WAVES_AN_OCTAVE * np.sum(gains**2)) ** -0.5  # the mean square of a wave is one half
