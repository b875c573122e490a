# SPDX-License-Identifier: GPL-3.0-or-later
"""Bend: segments rotate in a plane of the strand's frame, by default away from the surface. Roll winds up the tips.

    o'_i = d_i (cos θ_i t_i + sin θ_i (cos ψ u_i + sin ψ v_i)),    θ_i = A_si · angle

ψ points towards the root's normal, plus `turn`, plus random_turn · 2π (h - ½).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..params import param
from .base import Cutter, ProfiledSettings, Step, step_of

LABEL = "Bend"
DESCRIPTION = "Bend strands, or roll up their tips"
STEP = "BEND"
NUMBERS = ("angle", "direction", "random_turn")  # of bend.strand: both angles in turns
COURSES = ("amount", "angle")


@dataclass(frozen=True)
class Settings(ProfiledSettings):
    """Angle and direction of the bend."""

    angle: float = param(
        0.5,
        "Angle at the tip; whole turns roll the strand up",
        low=-20.0,
        high=20.0,
        unit="ROTATION",
        subtype="ANGLE",
        may_vary=True,
        has_course=True,
    )
    turn: float = param(
        0.0,
        "Direction of the bend about the strand; 0 is away from the surface",
        label="Direction",
        low=-math.pi,
        high=math.pi,
        unit="ROTATION",
        subtype="ANGLE",
        may_vary=True,
    )
    random_turn: float = param(
        0.0,
        "Random variation of the direction",
        label="Random direction",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )


ROLL = {"start": 0.75, "angle": 6.0 * math.pi}  # as added from the menu under the name Roll


def steps(settings: Settings, _cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps that bend strands."""
    angle, direction = settings.angle / (2.0 * math.pi), settings.turn / (2.0 * math.pi)
    return [step_of(settings, STEP, {"angle": angle, "direction": direction, "random_turn": settings.random_turn})]
