# SPDX-License-Identifier: GPL-3.0-or-later
"""What guides and strands store that other programs take: guides of strands, UV coordinates of roots, widths."""

import numpy as np

from ....core.geometry import strands
from . import attributes, curves


def read_guide_map(hair, guide_count):
    """(S, k) int32 guides of strands, -1 for none, and (S, k) float32 weights; None where hair stores none.

    Guides that are not among so many are none.
    """
    indices, weights = [], []
    while True:
        index = attributes.read(hair, f"guide_index_{len(indices)}", "INT", "CURVE")
        weight = attributes.read(hair, f"guide_weight_{len(indices)}", "FLOAT", "CURVE")
        if index is None or weight is None:
            break
        is_valid = (index >= 0) & (index < guide_count) & (weight > 0.0) & np.isfinite(weight)
        indices.append(np.where(is_valid, index, -1))
        weights.append(np.where(is_valid, weight, np.float32(0.0)))
    return (np.stack(indices, axis=1), np.stack(weights, axis=1)) if indices else None


def read_root_uvs(datablock):
    """(S, 2) float32; None where the surface has no UV map, or coordinates are not finite."""
    surface = datablock.surface
    if surface is None or surface.type != "MESH" or not surface.data.uv_layers:
        return None
    uvs = attributes.read(datablock, "surface_uv_coordinate", "FLOAT2", "CURVE")
    return uvs if uvs is not None and np.isfinite(uvs).all() else None


def read_radii(datablock, point_count):
    """A function of a slice of curves that gives radii (n, P) float32 in local units, at least zero.

    Of curves with other point counts they are interpolated along each.
    """
    stored, counts = attributes.read(datablock, "radius", "FLOAT", "POINT"), curves.point_counts(datablock)
    if stored is None or len(stored) != len(counts) * point_count:
        starts = curves.curve_offsets(datablock)
        stored = strands.resample_values(
            curves.read_radii(datablock), curves.read_points(datablock), starts, point_count
        )
    rows = stored.reshape(len(counts), point_count)
    return lambda some: attributes.valid_radii(rows[some])
