# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the tools that change combed guides.

Their mathematics is in other files, some of which import Warp: too slow for the registration of an add-on.
"""

import math
from dataclasses import dataclass

from ..params import Settings, param


@dataclass(frozen=True)
class ToolSettings(Settings):
    """Selection of the guides that a tool changes, and the strength of the effect."""

    selected_only: bool = param(
        True, "Change only the guides selected in Sculpt Mode or Edit Mode; all guides if none is selected"
    )
    mask: str = param(
        "",
        "Vertex group of the surface that scales the effect; guides rooted where its weight is zero do not change",
    )


@dataclass(frozen=True)
class LengthSettings(ToolSettings):
    """Settings for lengths of guides."""

    method: str = param(
        "SCALE",
        "How the new length of each guide is computed",
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
            ("CUT", "Cut", "Cut off the tips; the remaining part keeps its shape"),
            ("SCALE", "Scale", "Scale the whole guide"),
        ),
    )


@dataclass(frozen=True)
class TrimSettings(ToolSettings):
    """Settings for trimming guides."""

    cutter: str = param(
        "",
        "Object that cuts: a mesh cuts with its faces; any other object, such as an empty, cuts at its XY plane and "
        "removes the +Z side",
    )


@dataclass(frozen=True)
class SmoothSettings(ToolSettings):
    """Settings for smoothing guides."""

    strength: float = param(
        0.5, "Strength of each step; higher values smooth more", low=0.0, high=1.0, subtype="FACTOR"
    )
    iterations: int = param(
        10, "Number of smoothing steps; higher values smooth longer waves", low=1, high=1000, soft_high=100
    )


@dataclass(frozen=True)
class LiftSettings(ToolSettings):
    """Settings for lifting guides."""

    amount: float = param(
        0.5,
        "Fraction of the angle to the surface normal by which guides turn at their roots; at 1 they start along it",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    reach: float = param(
        1.0,
        "Fraction of the length along which the lift fades; lower values bend only the part near the root",
        above=0.0,
        high=1.0,
        subtype="FACTOR",
    )


@dataclass(frozen=True)
class DrapeSettings(ToolSettings):
    """Settings for draping guides."""

    stiffness: float = param(
        1.0,
        "Factor of the guides' stiffness in the Dynamics panel; lower values let them hang more",
        low=0.0,
        high=1e4,
        soft_high=10.0,
    )
    seconds: float = param(
        3.0,
        "Maximum time in seconds that guides fall; the tool stops earlier when they are at rest",
        above=0.0,
        high=60.0,
        soft_high=10.0,
    )


@dataclass(frozen=True)
class AttractSettings(ToolSettings):
    """Settings for attracting guides to the surface."""

    amount: float = param(
        0.5,
        "How far guides turn toward the surface; at 1 they lie on it",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    clearance: float = param(
        0.002,
        "Height of attracted guides above the surface; guides rise to it near their roots",
        low=0.0,
        high=1e3,
        soft_high=0.1,
        unit="LENGTH",
        subtype="DISTANCE",
    )


@dataclass(frozen=True)
class FlowSettings(ToolSettings):
    """Settings for painting the flow of guides."""

    radius: float = param(
        0.03,
        "Radius of the brush on the surface; guides near the edge of the brush turn less",
        above=0.0,
        high=1e6,
        soft_high=1.0,
        unit="LENGTH",
        subtype="DISTANCE",
    )
    strength: float = param(
        0.5,
        "How far each stroke turns guides; at 1, guides in the middle of a stroke take its direction",
        low=0.0,
        high=1.0,
        subtype="FACTOR",
    )
    lift: float = param(
        math.radians(30.0),
        "Largest angle between the surface and the turned guides; steeper guides are laid down to it",
        low=0.0,
        high=math.pi / 2.0,
        subtype="ANGLE",
    )
    mirrored: bool = param(False, "Paint on the other side of the surface too, mirrored along its local X axis")


@dataclass(frozen=True)
class OutsideSettings(ToolSettings):
    """Settings for pushing guides out of the surface."""

    clearance: float = param(
        0.0,
        "Minimum distance between guides and the surface",
        low=0.0,
        high=1e3,
        soft_high=0.1,
        unit="LENGTH",
        subtype="DISTANCE",
    )


@dataclass(frozen=True)
class CountSettings(ToolSettings):
    """Settings for changing the number of guides."""

    method: str = param(
        "FACTOR",
        "How the new number of guides is computed",
        choices=(
            (
                "FACTOR",
                "Factor",
                "Multiply the number of guides that are selected and inside the mask",
            ),
            ("COUNT", "Count", "Set the number of all guides"),
        ),
    )
    factor: float = param(
        2.0, "Factor of the number of guides; below 1 guides are removed", above=0.0, high=100.0, soft_high=4.0
    )
    guide_count: int = param(400, "New number of guides", label="Guide count", low=1, high=1_000_000, soft_high=4000)


@dataclass(frozen=True)
class MirrorSettings(ToolSettings):
    """Settings for mirroring guides across the object's X axis."""

    direction: str = param(
        "FROM_POSITIVE",
        "Side whose guides are kept; guides of the other side are replaced with their images",
        choices=(
            ("FROM_POSITIVE", "+X to -X", "Replace the guides on the -X side"),
            ("FROM_NEGATIVE", "-X to +X", "Replace the guides on the +X side"),
        ),
    )


@dataclass(frozen=True)
class CopySettings(Settings):
    """Settings for copying guide shapes between regions."""

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
        "Guide from which each guide takes its shape",
        choices=(
            ("FITTED", "Fitted", "The guide in the same place after the regions are aligned"),
            ("NEAREST", "Nearest", "The nearest guide"),
            ("MIRRORED", "Mirrored", "The guide nearest to the place mirrored across the object's X axis"),
        ),
    )
    copy_length: bool = param(True, "Copy the length too; when off, guides keep their lengths")
    amount: float = param(1.0, "How much of the shape is copied", low=0.0, high=1.0, subtype="FACTOR")
