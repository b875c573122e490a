# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes and polylines as arrays: sampling, transforms, frames of roots, surface deformation."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        affine,
        closest_point,
        curvature,
        fingerprint,
        landmark_warp,
        mesh,
        mirror,
        nearest_rotation,
        packed_strands,
        root_frames,
        sampling,
        search,
        smooth_surface,
        strands,
        surface_deform,
        transform,
        vertex_turns,
    )
else:
    __getattr__ = submodules(__name__)
