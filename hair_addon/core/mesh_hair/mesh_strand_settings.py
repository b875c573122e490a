# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of strands from meshes of cards, tubes and solid locks."""

from dataclasses import dataclass

from ..params import Settings, param

MOST_STRANDS = 5_000_000


@dataclass(frozen=True)
class MeshStrandSettings(Settings):
    """Settings of strands from a mesh of cards, tubes or locks."""

    strand_count: int = param(
        10_000,
        "Number of strands, shared by the area of cards, tubes and locks; each has at least one",
        low=1,
        high=MOST_STRANDS,
        soft_high=200_000,
    )
    root_end: str = param(
        "SURFACE",
        "End of each card, tube or lock that is its root",
        label="Roots",
        choices=(
            ("SURFACE", "Nearest to Surface", "The end nearer to the surface; if both are as near, the wider end"),
            ("LOW_V", "Low V", "The end with the lower V coordinate in the UV map"),
            ("HIGH_V", "High V", "The end with the higher V coordinate in the UV map"),
        ),
    )
    fills: bool = param(
        False,
        "Make strands so thick that they fill their card, tube or lock together; when off, as thick as new hair",
        label="Fill Thickness",
    )
    reaches_surface: bool = param(
        True, "Start strands on the surface: cut them where they leave it, or extend them to it", label="Reach Surface"
    )
    uses_alpha: bool = param(
        True,
        "Let strands follow the opaque parts of the texture, and end where it is transparent",
        label="Use Alpha",
    )
    seed: int = param(1, "Random seed; each value gives another random distribution", low=0, high=2**31 - 1)
