# SPDX-License-Identifier: GPL-3.0-or-later
"""Dynamics: guides as elastic rods that move with their surface, in SI units."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        air,
        collision,
        draped_growth,
        draping,
        hair_cells,
        hair_volume,
        moving_mesh,
        outside,
        rod,
        root_motion,
        simulation,
        topology_changes,
    )
else:
    __getattr__ = submodules(__name__)
