# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the tools that change combed guides, whose mathematics is in the files beside this one.

Some of those import Warp, which takes longer than an add-on may take to register: so settings are apart.
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
class DrapeSettings(ToolSettings):
    """Draping of guides."""

    stiffness: float = param(
        1.0,
        "Factor of the stiffness that the guides have in the Dynamics panel; lower values let them hang more",
        low=0.0,
        high=1e4,
        soft_high=10.0,
    )
    seconds: float = param(
        3.0,
        "Longest time in seconds that guides fall; what is at rest sooner stops the tool",
        above=0.0,
        high=60.0,
        soft_high=10.0,
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


@dataclass(frozen=True)
class CountSettings(ToolSettings):
    """Another number of guides."""

    method: str = param(
        "FACTOR",
        "How the new number of guides is found",
        choices=(
            (
                "FACTOR",
                "Factor",
                "Multiply the number of guides, where they are selected and inside the mask",
            ),
            ("COUNT", "Count", "Set the number of all guides"),
        ),
    )
    factor: float = param(
        2.0, "Factor of the number of guides; below 1 guides are removed", above=0.0, high=100.0, soft_high=4.0
    )
    guide_count: int = param(
        400, "Number of guides to have", label="Guide count", low=1, high=1_000_000, soft_high=4000
    )


@dataclass(frozen=True)
class MirrorSettings(ToolSettings):
    """Mirroring of guides across the object's X axis."""

    direction: str = param(
        "FROM_POSITIVE",
        "Side whose guides are kept; those of the other side are replaced with their images",
        choices=(
            ("FROM_POSITIVE", "+X to -X", "Replace the guides on the -X side"),
            ("FROM_NEGATIVE", "-X to +X", "Replace the guides on the +X side"),
        ),
    )


@dataclass(frozen=True)
class CopySettings(Settings):
    """Copying of guide shapes between regions."""

    source: str = param(
        "",
        "Vertex group of the guides to copy from. Leave empty to copy from the selected guides",
        label="From",
    )
    target: str = param(
        "",
        "Vertex group of the guides to change; its weights scale the effect. Leave empty to change all other guides",
        label="To",
    )
    mapping: str = param(
        "FITTED",
        "Which guide each one takes its shape from",
        choices=(
            ("FITTED", "Fitted", "The one in the same place when the regions are laid over each other"),
            ("NEAREST", "Nearest", "The nearest one"),
            ("MIRRORED", "Mirrored", "The one nearest to its place mirrored across the object's X axis"),
        ),
    )
    copy_length: bool = param(True, "Copy the length too; when off, guides keep their lengths")
    amount: float = param(1.0, "How much of the shape is copied", low=0.0, high=1.0, subtype="FACTOR")
