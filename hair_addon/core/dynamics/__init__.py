# SPDX-License-Identifier: GPL-3.0-or-later
"""Dynamics: guides as elastic rods that move with their surface, in units of the SI."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        air,
        closed_parts,
        collider_settings,
        colliders,
        contact,
        contact_queries,
        contact_substep,
        detail,
        distance_grid,
        draped_growth,
        draping,
        hair_cells,
        hair_volume,
        material,
        moving_mesh,
        nearest_surface,
        outside,
        presets,
        rigid_motion,
        rod_solver,
        rods,
        root_motion,
        rotations,
        sag_free,
        settings,
        simulation,
        stiffness_advice,
        stopped_colliders,
        surface_motions,
    )
else:
    __getattr__ = submodules(__name__)
