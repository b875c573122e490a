# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that strands collide with: distances, contact planes, and substeps of strands with contacts."""

from typing import TYPE_CHECKING

from ...lazy import submodules

if TYPE_CHECKING:
    from . import (
        closed_parts,
        collider_settings,
        colliders,
        contact,
        contact_queries,
        contact_substep,
        distance_grid,
        nearest_surface,
        rigid_motion,
        surface_motions,
    )
else:
    __getattr__ = submodules(__name__)
