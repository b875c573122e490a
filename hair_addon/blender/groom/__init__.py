# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms in Blender: read geometry and settings, compute, write geometry; staleness, diagnostics and repairs."""

from typing import TYPE_CHECKING

from ...core.lazy import submodules

if TYPE_CHECKING:
    from . import (
        applied_transforms,
        attached_hair,
        bindings,
        changed_weights,
        copied_hair,
        diagnostics,
        edited_faces,
        edited_surfaces,
        edits,
        followed_names,
        frame_faces,
        grown_guides,
        guide_maps,
        hair_memory,
        hair_systems,
        hidden_hair,
        mask_suggestions,
        pipeline,
        posed_shapes,
        read_surfaces,
        reused_roots,
        selection,
        size_fitting,
        staleness,
        styled_hair,
        writing,
    )
else:
    __getattr__ = submodules(__name__)
