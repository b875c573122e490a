# SPDX-License-Identifier: GPL-3.0-or-later
"""Braid: the strands of a lock gather into tresses that weave around the lock's center; two tresses are a rope.

    ρ = R (sin(φ + 2πg/n), b sin 2(φ + 2πg/n)) for three tresses,    ρ = R (cos(φ + πg), sin(φ + πg)) for two

ρ is in the frames of the lock's center, φ grows by 2π per pitch along it, and g is the tress of a strand, by its place
in the lock. The distance a of a point along the center depends only on its arc length s:

    da/ds = 1 / sqrt(1 + |dρ/da|²)

so no point slides along its tress when the hair swings; where strands gather, they stretch by half at most. Center
lines of three tresses are at least 0.90 R apart for a pitch of 6 R, so the radius of a tress can be half of this.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ..params import param, param_of
from .base import Cutter, LockSettings, ProfiledSettings, Step, TreeSettings, step_of

LABEL = "Braid"
DESCRIPTION = "Braid or twist the strands of a lock"
STEP = "WEAVE"
SHARED_BY_LOCKS = True
NEEDS_CENTRE = True
NUMBERS = ("radius", "pitch", "flat_part", "tress_count", "thickness")  # of weave.strand
COURSES = ("amount", "radius", "thickness")

PATTERNS = (
    ("BRAID", "Braid", "Three tresses, each over the next in turn"),
    ("ROPE", "Rope", "Two tresses around each other"),
)


@dataclass(frozen=True)
class Settings(LockSettings):
    """Size of a braid and of its tresses."""

    centers: str = param_of(LockSettings, "centers", description="Positions of the centers of the braids")
    pattern: str = param("BRAID", "How tresses weave", choices=PATTERNS)
    size: float = param(
        0.05,
        "Distance between the centers of the braids on the surface",
        above=0.0,
        high=1e3,
        soft_high=0.2,
        unit="LENGTH",
        subtype="DISTANCE",
        is_structural=True,
        may_vary=True,
    )
    radius: float = param(
        0.006,
        "Distance of the tresses from the center of the braid",
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
        0.04,
        "Distance along the braid after which the tresses repeat",
        low=1e-4,
        high=1e4,
        soft_high=0.2,
        unit="LENGTH",
        subtype="DISTANCE",
        precision=4,
        may_vary=True,
    )
    flatness: float = param(0.5, "Flatten a braid of three tresses", low=0.0, high=1.0, subtype="FACTOR", may_vary=True)
    thickness: float = param(
        0.1,
        "Distance between the strands of a tress at full strength, as a part of the distance before",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
        has_course=True,
    )
    start: float = param_of(ProfiledSettings, "start", 0.1)
    shape: float = param_of(ProfiledSettings, "shape", 0.1)


def tree(settings: Settings) -> TreeSettings:
    """Return the inputs of the sites of braids."""
    return TreeSettings((settings.size,), settings.seed, 0.0)


def steps(settings: Settings, _cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps that weave strands."""
    numbers = {name: getattr(settings, name) for name in ("radius", "pitch", "thickness")}
    numbers |= {"flat_part": 1.0 - settings.flatness, "tress_count": 3.0 if settings.pattern == "BRAID" else 2.0}
    return [step_of(settings, STEP, numbers, level=0)]
