# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings for gathering guides at a tie."""

from dataclasses import dataclass

from ...params import param
from ..guide_tool_settings import ToolSettings


def _length(default: float, description: str, above: float = 0.0) -> float:
    return param(default, description, above=above, high=1e3, soft_high=0.2, unit="LENGTH", subtype="DISTANCE")


@dataclass(frozen=True)
class GatherSettings(ToolSettings):
    """Settings for gathering guides at a tie."""

    line: str = param(
        "",
        "Curve object whose curves gather the guides nearest to them: each begins at its tie and leads the tail",
    )
    shape: str = param(
        "PONYTAIL",
        "What the hair does behind the tie",
        choices=(
            ("PONYTAIL", "Ponytail", "A tail along the curve"),
            ("BRAID", "Braid", "Three locks that cross in turn, along the curve"),
            ("ROPE", "Rope", "Two locks twisted around each other, along the curve"),
            ("CORNROWS", "Cornrows", "Braids on the surface: each curve is a row, which hair joins from both sides"),
            ("BUN", "Bun", "Coiled on the surface around the tie, with the ends tucked in"),
        ),
    )
    tightness: float = param(
        0.9,
        "How closely hair follows the surface to the tie; lower values let it bulge",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    tie_radius: float = _length(0.008, "Radius of the hair at the tie")
    tail_radius: float = _length(0.018, "Radius of the tail or braid")
    bun_radius: float = _length(0.035, "Radius of the bun")
    turns: float = param(
        2.0, "Turns of the coil of a bun; more turns make the coil thinner", above=0.0, high=100.0, soft_high=10.0
    )
    pitch: float = _length(0.05, "Length of the braid or rope in which each lock returns to its place")
    clearance: float = param(
        0.002,
        "Height of hair above the surface on its way to the tie",
        low=0.0,
        high=1e3,
        soft_high=0.1,
        unit="LENGTH",
        subtype="DISTANCE",
    )
