# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools that edit, add and remove guides."""

from typing import TYPE_CHECKING

from ....core.lazy import submodules

if TYPE_CHECKING:
    from . import (
        brushes,
        flow_painting,
        frozen_guides,
        gathered_guides,
        guide_additions,
        guide_regions,
        guide_states,
        guide_tools,
        layer_changes,
        line_drawing,
        outside_guides,
    )
else:
    __getattr__ = submodules(__name__)
