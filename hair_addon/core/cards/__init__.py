# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair for games: clumps of strands as cards with a texture atlas, and strands as tubes."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        atlas,
        bone_chains,
        card_settings,
        curve_frames,
        outlines,
        polygon_mesh,
        ribbons,
        spring_colliders,
        texels,
        tubes,
    )
else:
    __getattr__ = submodules(__name__)
