# SPDX-License-Identifier: GPL-3.0-or-later
"""Grooms in Blender: read geometry and settings, compute, write geometry; staleness, diagnostics and repairs."""

from typing import TYPE_CHECKING

from ...core.lazy import submodules

if TYPE_CHECKING:
    from . import (
        bindings,
        brushes,
        carried_masks,
        diagnostics,
        edited_surfaces,
        edits,
        foreign_curves,
        groom_settings,
        groom_transfers,
        grown_guides,
        guide_additions,
        guide_maps,
        guide_regions,
        guide_tools,
        hair_styles,
        hair_systems,
        hand_made_guides,
        kept_following,
        kept_hair,
        library_groom,
        painted_masks,
        particle_hair,
        pipeline,
        reweighed_hair,
        selection,
        staleness,
        style_notes,
        styled_hair,
        transferred_names,
        writing,
    )
else:
    __getattr__ = submodules(__name__)
