# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms in Blender: read geometry and settings, compute, write geometry; staleness, diagnostics and repairs."""

from typing import TYPE_CHECKING

from ...core.lazy import submodules

if TYPE_CHECKING:
    from . import (
        bindings,
        changed_weights,
        followed_names,
        frame_faces,
        grown_guides,
        guide_maps,
        hair_memory,
        hidden_hair,
        mapped_wetness,
        pipeline,
        read_surfaces,
        reused_roots,
        selection,
        size_fitting,
        staleness,
        strand_lengths,
        strand_thickness,
        styled_hair,
        varied_guides,
        varied_strands,
        varied_styles,
        writing,
    )
else:
    __getattr__ = submodules(__name__)
