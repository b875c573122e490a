# SPDX-License-Identifier: GPL-3.0-or-later
"""Clump: strands gather around center strands, which are not part of the hair.

Centers are spaced evenly on the surface; those of the largest locks may also be chosen guides.

At the arc length s_i of a point p_i, with C the center strand of level k after the levels before, and c = C(s_i):

    q_i = c + (1 - B_ki (1 - thickness)) Rot(t_c, 2π twist · profile(x_i)) (p_i - c)

The strand follows the curve of these points up to its own length, so that strands pulled onto the center lie on it
(clump.strand). Roots do not move: the pull grows from the root over twice the distance to the center. The fraction
`stray` of strands joins no lock; a tenth more joins partly, so that the fraction can be animated. Sites and levels are
in clump_trees.py.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..params import param, param_of
from .base import Cutter, LockSettings, ProfiledSettings, Step, TreeSettings, step_of

LABEL = "Clump"
DESCRIPTION = "Gather strands into locks, and locks into larger ones"

MOST_LEVELS = 4
STEP = "CLUMP"
SHARED_BY_LOCKS = True
NEEDS_CENTRE = True
NUMBERS = ("thickness", "twist", "stray")  # of clump.strand
COURSES = ("amount", "thickness", "twist")


@dataclass(frozen=True)
class Settings(LockSettings):
    """Centers, size and strength of locks."""

    size: float = param(
        0.012,
        "Distance between the centers of the largest locks",
        above=0.0,
        high=1e3,
        soft_high=0.1,
        unit="LENGTH",
        subtype="DISTANCE",
        precision=4,
        is_structural=True,
        may_vary=True,
    )
    levels: int = param(
        2,
        "Levels of locks: each lock is made of smaller ones. A map cannot vary a whole number",
        low=1,
        high=MOST_LEVELS,
        is_structural=True,
    )
    ratio: float = param(
        0.4,
        "Size of a level's locks as a part of the size of the level above",
        label="Size ratio",
        low=0.1,
        high=0.9,
        subtype="FACTOR",
        is_structural=True,
        may_vary=True,
    )
    fine_amount: float = param(
        0.8,
        "Strength of the smallest locks relative to the largest; levels between are in between",
        label="Fine strength",
        low=0.0,
        high=10.0,
        soft_high=2.0,
        may_vary=True,
    )
    thickness: float = param(
        0.12,
        "Distance between the strands of a lock at full strength, as a part of the distance before",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
        has_course=True,
    )
    twist: float = param(
        0.0, "Turns of a lock about its center from root to tip", low=-10.0, high=10.0, may_vary=True, has_course=True
    )
    crossover: float = param(
        0.05,
        "Part of the strands that belongs to the second nearest lock",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        is_structural=True,
        may_vary=True,
    )
    stray: float = param(
        0.03, "Part of the strands that joins no lock", low=0.0, high=1.0, subtype="FACTOR", may_vary=True
    )
    tip_level: int = param(
        0,
        "Level of locks whose strands curl alike in the styles below; 0 is the largest. "
        "A map cannot vary a whole number",
        label="Coherent level",
        low=0,
        high=MOST_LEVELS - 1,
    )
    shape: float = param_of(ProfiledSettings, "shape", 0.32)


def sizes(settings: Settings) -> list[float]:
    """Return the distances [m] between the centers of each level's locks, the largest first."""
    return [settings.size * settings.ratio**level for level in range(settings.levels)]


def amounts(settings: Settings) -> list[Any]:
    """Return the strength of each level's locks, the largest first. All are zero if the amount is zero.

    Strengths are arrays (S,) if the settings differ between strands.
    """
    parts = [level / max(settings.levels - 1, 1) for level in range(settings.levels)]
    return [np.minimum(settings.amount * (1.0 - part + part * settings.fine_amount), 1.0) for part in parts]


def tree(settings: Settings) -> TreeSettings:
    """Return the inputs of the clump sites, without the indices of chosen guides."""
    return TreeSettings(tuple(sizes(settings)), settings.seed, settings.crossover)


def steps(settings: Settings, _cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps that gather strands, one for each level."""
    own = {"thickness": settings.thickness, "twist": settings.twist / settings.levels, "stray": settings.stray}
    return [step_of(settings, STEP, own, amount=amount, level=level) for level, amount in enumerate(amounts(settings))]
