# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair from meshes: cards, tubes and solid locks as strands."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        alpha_paths,
        card_lines,
        lock_sections,
        mesh_pieces,
        mesh_strand_settings,
        mesh_strands,
        piece_strands,
        ribbon_charts,
        surface_roots,
        texture_alpha,
    )
else:
    __getattr__ = submodules(__name__)
