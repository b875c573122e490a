# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth: each segment takes the direction of the chord over a length around it, twice. Straighten uses any length.

A wave is reduced to sinc²(length / wavelength): 0.41 at twice the length, zero at the length.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ..params import param, param_of
from .base import Cutter, ProfiledSettings, Step, step_of

LABEL = "Smooth"
DESCRIPTION = "Smooth or straighten strands"
STEP = "SMOOTH"
NUMBERS = ("chord",)  # of smooth.strand: the length that is averaged [m]
COURSES = ("amount",)


@dataclass(frozen=True)
class Settings(ProfiledSettings):
    """Length over which strands are smoothed."""

    length: float = param(
        0.02,
        "Length of strand that is averaged; beyond twice a strand's length it becomes straight",
        above=0.0,
        high=1e4,
        soft_high=0.2,
        unit="LENGTH",
        subtype="DISTANCE",
        may_vary=True,
    )
    root: float = param_of(ProfiledSettings, "root", 1.0)


STRAIGHTEN = {"length": 10.0}  # as added from the menu under the name Straighten


def steps(settings: Settings, _cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps that smooth strands."""
    return [step_of(settings, STEP, {"chord": settings.length})]
