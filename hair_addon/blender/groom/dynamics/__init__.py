# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulation, baking and draping of guides, with frames cached in files."""

from typing import TYPE_CHECKING

from ....core.lazy import submodules

if TYPE_CHECKING:
    from . import (
        bake_resuming,
        broken_guides,
        dynamics_notes,
        frame_folders,
        guide_baking,
        guide_draping,
        guide_simulation,
    )
else:
    __getattr__ = submodules(__name__)
