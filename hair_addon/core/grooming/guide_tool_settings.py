# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the tools that change combed guides: each in a file of its own, of the same name.

They stand here because those files import Warp, which takes longer than an add-on may take to register.
"""

from dataclasses import dataclass

from ..params import Settings, param


@dataclass(frozen=True)
class ToolSettings(Settings):
    """Which guides a tool changes, and how much."""

    selected_only: bool = param(
        True, "Change only the guides selected in Sculpt Mode or Edit Mode; all guides if none is selected"
    )
    mask: str = param(
        "",
        "Vertex group of the surface that scales the effect; guides rooted where its weight is zero stay as they are",
    )


@dataclass(frozen=True)
class LengthSettings(ToolSettings):
    """New lengths of guides."""

    method: str = param(
        "SCALE",
        "How the new length of each guide is found",
        choices=(
            ("SCALE", "Scale", "Multiply the lengths"),
            ("SET", "Set", "Make all guides equally long"),
            ("MINIMUM", "Minimum", "Make shorter guides this long"),
            ("MAXIMUM", "Maximum", "Make longer guides this long"),
        ),
    )
    factor: float = param(
        1.0, "Factor of the lengths; below 1 guides become shorter", above=0.0, high=1e3, soft_high=4.0
    )
    length: float = param(
        0.1, "Length from root to tip", above=0.0, high=1e6, soft_high=1.0, unit="LENGTH", subtype="DISTANCE"
    )
    shorten: str = param(
        "CUT",
        "How guides become shorter; longer ones are always scaled",
        choices=(
            ("CUT", "Cut", "Cut off the tips; what is left keeps its shape"),
            ("SCALE", "Scale", "Scale the whole guide"),
        ),
    )


@dataclass(frozen=True)
class TrimSettings(ToolSettings):
    """Trimming of guides."""

    cutter: str = param(
        "",
        "Object that cuts: a mesh with its faces; any other object, such as an empty, cuts off what is on its +Z side",
    )


@dataclass(frozen=True)
class SmoothSettings(ToolSettings):
    """Smoothing of guides."""

    strength: float = param(
        0.5, "Strength of each step; higher values smooth more", low=0.0, high=1.0, subtype="FACTOR"
    )
    iterations: int = param(
        10, "Number of smoothing steps; more of them smooth longer waves", low=1, high=1000, soft_high=100
    )


@dataclass(frozen=True)
class LiftSettings(ToolSettings):
    """Lifting of guides."""

    amount: float = param(
        0.5,
        "Part of the angle to the surface normal that guides turn by at their roots; at 1 they start along the normal",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    reach: float = param(
        1.0,
        "Part of the length along which the lift fades; lower values bend only the part near the root",
        above=0.0,
        high=1.0,
        subtype="FACTOR",
    )


@dataclass(frozen=True)
class AttractSettings(ToolSettings):
    """Attraction to the surface."""

    amount: float = param(
        0.5,
        "How far guides turn toward the surface; at 1 they lie on it",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    clearance: float = param(
        0.002,
        "Height above the surface that guides keep, from a short way above their roots",
        low=0.0,
        high=1e3,
        soft_high=0.1,
        unit="LENGTH",
        subtype="DISTANCE",
    )
