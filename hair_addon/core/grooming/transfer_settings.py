# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a groom's transfer to another mesh; separate from its mathematics, which imports Warp."""

from dataclasses import dataclass

from ..params import Settings, param


@dataclass(frozen=True)
class TransferSettings(Settings):
    """Settings of the transfer of guides to another mesh."""

    method: str = param(
        "NEAREST",
        "How the new root of each guide is found",
        choices=(
            (
                "NEAREST",
                "Nearest Surface",
                "The nearest point of the surface after both meshes are aligned",
            ),
            ("UV", "UV Map", "The point with the same UV coordinates, in the active UV maps of both meshes"),
            (
                "LANDMARKS",
                "Landmarks",
                "The nearest point after the landmarks of both meshes are aligned: vertex groups or empty children of "
                'either mesh with matching names that start with "Landmark"',
            ),
        ),
    )
    alignment: str = param(
        "BOXES",
        "How the meshes are aligned to find the nearest surface",
        choices=(
            ("BOXES", "Bounding Boxes", "Move and scale the box around one mesh to the box around the other"),
            ("LOCAL", "Object Coordinates", "Align origin, rotation and scale of both objects"),
            ("WORLD", "As They Are", "Use the positions of both meshes in the scene"),
        ),
    )
    reach: float = param(
        0.05,
        "Farthest distance to the surface at which a root is found, as a fraction of the surface's size; "
        "guides farther away are left out",
        above=0.0,
        high=10.0,
        soft_high=0.5,
        subtype="FACTOR",
    )
    scale_lengths: bool = param(
        True, "Scale guides, thickness and styles with the surface; when off, everything keeps its size"
    )
