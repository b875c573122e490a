# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair for games: clumps of strands as cards with a texture atlas, and strands as tubes."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        atlas,
        best_placement,
        bone_chains,
        card_error,
        card_exchange,
        card_layout,
        card_settings,
        card_views,
        nearest_triangles,
        outlines,
        polygon_mesh,
        ribbons,
        spring_colliders,
        strand_sample,
        texels,
        texture_layouts,
        tubes,
    )
else:
    __getattr__ = submodules(__name__)
