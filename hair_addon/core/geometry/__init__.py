# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes and polylines as arrays: sampling, nearest neighbours, clusters, evaluation, surface deformation."""

from typing import TYPE_CHECKING

from ..lazy import submodules

if TYPE_CHECKING:
    from . import (
        affine,
        bezier_segments,
        bspline,
        cages,
        closest_point,
        clusters,
        connected_components,
        counting_sort,
        curvature,
        face_places,
        fingerprint,
        flipped_faces,
        hash_grid,
        landmark_warp,
        mesh,
        mirror,
        nearest_rotation,
        orientation,
        packed_strands,
        resampling,
        root_frames,
        sampling,
        smooth_surface,
        strands,
        surface_deform,
        transform,
        triangle_tree,
        uv_maps,
        vertex_turns,
    )
else:
    __getattr__ = submodules(__name__)
