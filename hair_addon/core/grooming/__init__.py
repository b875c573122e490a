# SPDX-License-Identifier: GPL-3.0-or-later
"""The grooming pipeline as functions of arrays: guide distribution and growth, guide tools, hair generation."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        cost,
        derived_guides,
        flow_lines,
        following,
        groom,
        groom_defaults,
        groom_passage,
        groom_transfer,
        guide_attraction,
        guide_copies,
        guide_count,
        guide_growth,
        guide_layers,
        guide_lengths,
        guide_shapes,
        guide_tool_settings,
        guide_trim,
        layer_kernels,
        layer_transfer,
        painted_flow,
        rooted_curves,
        style_binding,
        transfer_settings,
    )
else:
    __getattr__ = submodules(__name__)
