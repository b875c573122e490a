# SPDX-License-Identifier: GPL-3.0-or-later
"""Wet: strands cling to the surface, lose their waves and join into pointed locks, small ones first.

With w the amount: guides lean down by cling · w over the first 0.3 of their length; strands are smoothed over twice the
lock size by relax · w, and clump in two levels with amounts 0.92 w^1.5 (large) and 0.92 w^½ (small; 9.2 w up to
w = 0.01, because a square root starts vertically). Shading and simulated guides use w as their wetness, a value per
strand if a mask or a variation makes w differ (strand_wetness.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..params import param, param_of
from . import clump, smooth
from .base import EVERYWHERE, Cutter, Profile, Step, StyleSettings, TreeSettings, profile_of, step_of

LABEL = "Wet"
DESCRIPTION = "Soak hair: it clings, joins into locks and darkens"

CLEARANCE = 0.15  # of wet guides from the surface, as a fraction of the size of locks

_RATIO = 0.32  # size of the small wet locks as a fraction of the large ones
_THICKNESS = 0.10
_SMOOTHING = 2.0  # smoothed length as a multiple of the size of locks
_CLUMP = 0.92
_START = 0.01  # amount below which small locks join linearly: a square root would start abruptly


@dataclass(frozen=True)
class Settings(StyleSettings):
    """Wetness and the size of wet locks."""

    lock: float = param(
        0.015,
        "Distance between the centers of the largest wet locks",
        label="Lock size",
        above=0.0,
        high=1e3,
        soft_high=0.1,
        unit="LENGTH",
        subtype="DISTANCE",
        is_structural=True,
        may_vary=True,
    )
    cling: float = param(
        0.35, "How far wet hair leans down at its roots", low=0.0, high=1.0, subtype="FACTOR", may_vary=True
    )
    relax: float = param(
        0.8, "How far water straightens curls and waves", low=0.0, high=1.0, subtype="FACTOR", may_vary=True
    )
    vary: float = param_of(StyleSettings, "vary", may_vary=False)  # the shading varies by it too
    swelling: float = param(0.15, "Increase of the radius of a soaked strand", low=0.0, high=1.0, subtype="FACTOR")


def tree(settings: Settings) -> TreeSettings:
    """Return the inputs of the sites of wet locks."""
    return TreeSettings((settings.lock, settings.lock * _RATIO), settings.seed, 0.0)


def steps(settings: Settings, _cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps that straighten strands and gather them in large locks and then in small ones."""
    wetness = settings.amount
    along = Profile(0.0, 1.0, profile_of(clump.Settings()).exponent)
    chord = {"chord": settings.lock * _SMOOTHING}
    smoothing = step_of(settings, smooth.STEP, chord, amount=settings.relax * wetness, profile=EVERYWHERE)
    own = {"thickness": _THICKNESS, "twist": 0.0, "stray": 0.0}
    large = step_of(settings, clump.STEP, own, amount=_CLUMP * wetness**1.5, profile=along, level=0)
    small_amount = _CLUMP * wetness / max(wetness, _START) ** 0.5
    return [smoothing, large, replace(large, amount=small_amount, level=1)]
