# SPDX-License-Identifier: GPL-3.0-or-later
"""Lean: guides turn down, away from the surface or along an object's axis, with a clearance from the surface.

    t'_i = unit((1 - A) t_i + A D)

The style acts on guides, which are few, because it compares each point with the surface; strands follow guides.
"""

from dataclasses import dataclass

from ..params import param, param_of
from .base import ProfiledSettings

LABEL = "Lean"
DESCRIPTION = "Lean hair down, away from the surface or along an object's axis"

DIRECTIONS = (
    ("DOWN", "Down", "Along the world's negative Z axis"),
    ("NORMAL", "Normal", "Away from the surface"),
    ("OBJECT", "Object", "Along the Z axis of an object"),
)


@dataclass(frozen=True)
class Settings(ProfiledSettings):
    """Direction in which hair leans."""

    direction: str = param("DOWN", "Direction in which hair leans", choices=DIRECTIONS)
    target: str = param("", "Object whose Z axis hair leans along", label="Object")
    clearance: float = param(
        0.004,
        "Distance from the surface that guides keep",
        low=0.0,
        high=1e3,
        soft_high=0.05,
        unit="LENGTH",
        subtype="DISTANCE",
        precision=4,
        may_vary=True,
    )
    root: float = param_of(ProfiledSettings, "root", 0.0)


LIFT = {"direction": "NORMAL", "root": 1.0, "tip": 0.0}  # as added from the menu under the name Lift
