# SPDX-License-Identifier: GPL-3.0-or-later
"""Trim: shorter strands, by a factor, to a length, by an undercoat or at a plane.

    L' = min(L · factor · (1 - random · h), to_length or ∞), times undercoat_length for the fraction `undercoat`

The length of a strand becomes L + amount (L' - L), so the mask of the style is a mask of lengths. A twentieth of the
strands is between the undercoat and the others, so that the fraction can be animated.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..params import param
from .base import Cutter, Step, StyleSettings, of_each, step_of

LABEL = "Trim"
DESCRIPTION = "Cut or scale strands to a length"
STEP = "TRIM"
CHANGES_LENGTHS = True
# Of trim.strand.
NUMBERS = (
    "factor",
    "random_part",
    "to_length",
    "undercoat",
    "undercoat_length",
    "is_cut",
    "has_plane",
    "axis_x",
    "axis_y",
    "axis_z",
    "plane_distance",
)
NO_LIMIT = 1e30  # [m]

METHODS = (
    ("CUT", "Cut", "Cut strands off; the rest keeps its place"),
    ("SCALE", "Scale", "Scale strands down; their shape stays"),
)


@dataclass(frozen=True)
class Settings(StyleSettings):
    """Lengths of strands."""

    factor: float = param(
        1.0, "Part of its length that a strand keeps; values above 1 lengthen it", low=0.0, high=4.0, may_vary=True
    )
    random: float = param(
        0.0,
        "Random variation of the length; higher values make some strands shorter",
        label="Random length",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    to_length: float = param(
        0.0,
        "Length that no strand exceeds; 0 is no limit",
        label="Maximum length",
        low=0.0,
        high=1e6,
        soft_high=1.0,
        unit="LENGTH",
        subtype="DISTANCE",
        may_vary=True,
    )
    undercoat: float = param(
        0.0,
        "Part of the strands that is an undercoat of shorter ones",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    undercoat_length: float = param(
        0.5,
        "Length of the undercoat as a part of the other strands' length",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
        may_vary=True,
    )
    method: str = param("CUT", "How strands become shorter", choices=METHODS)
    cutter: str = param("", "Empty object that cuts off what lies on the side of its Z axis")


def steps(settings: Settings, cutters: Mapping[str, Cutter]) -> list[Step]:
    """Return the steps that trim strands; cutters: planes by their names in settings."""
    cutter = cutters.get(settings.cutter)
    axis = (0.0, 0.0, 0.0) if cutter is None else cutter.normal
    numbers = {
        "factor": settings.factor,
        "random_part": settings.random,
        "to_length": of_each(lambda length: length or NO_LIMIT, settings.to_length),
        "undercoat": settings.undercoat,
        "undercoat_length": settings.undercoat_length,
        "is_cut": float(settings.method == "CUT"),
        "has_plane": float(cutter is not None),
        **{f"axis_{name}": float(value) for name, value in zip("xyz", axis, strict=True)},
        "plane_distance": 0.0 if cutter is None else float(np.dot(cutter.normal, cutter.point)),
    }
    return [step_of(settings, STEP, numbers)]
