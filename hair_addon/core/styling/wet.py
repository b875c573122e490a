# SPDX-License-Identifier: GPL-3.0-or-later
"""Wet: strands cling to the surface, lose their waves and join into pointed locks, small ones first.

With w the amount: guides lean down by cling · w over the first 0.3; strands are smoothed over twice the lock
size by relax · w, and clump in two levels with amounts 0.92 w^1.5 (large) and 0.92 w^½ (small; 9.2 w up to w = 0.01, as
a root begins vertically). Shading takes the same w as its wetness, that of each strand where a mask or a variation
makes them differ (strand_wetness.py), and so do simulated guides.
"""

from dataclasses import dataclass

from ..params import param
from .base import StyleSettings

LABEL = "Wet"
DESCRIPTION = "Soak hair: it clings, joins into locks and darkens"

CLEARANCE = 0.15  # of wet guides from the surface, by the size of locks


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
    )
    cling: float = param(0.35, "How far wet hair leans down at its roots", low=0.0, high=1.0, subtype="FACTOR")
    relax: float = param(0.8, "How far water straightens curls and waves", low=0.0, high=1.0, subtype="FACTOR")
    swelling: float = param(0.15, "Increase of the radius of a soaked strand", low=0.0, high=1.0, subtype="FACTOR")
