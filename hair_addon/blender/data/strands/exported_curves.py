# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported data of guides and strands: guides of strands, UV coordinates of roots, widths, points."""

import numpy as np

from ....core.geometry import strands
from ....core.geometry.curves import bezier_segments
from ....core.grooming import groom
from . import attributes, curves


def read_guide_map(hair, guide_count):
    """Return (S, k) int32 guides of strands, -1 for none, and (S, k) float32 weights; None if hair stores none.

    Guide indices outside of `guide_count` become -1.
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
    """Return (S, 2) float32; None if the surface has no UV map or coordinates are not finite."""
    surface = datablock.surface
    if surface is None or surface.type != "MESH" or not surface.data.uv_layers:
        return None
    uvs = attributes.read(datablock, "surface_uv_coordinate", "FLOAT2", "CURVE")
    return uvs if uvs is not None and np.isfinite(uvs).all() else None


def read_radii(datablock, point_count):
    """Return a function of a slice of curves that returns (n, P) float32 radii in local units, at least zero.

    Radii are interpolated along curves with other point counts.
    """
    stored, counts = attributes.read(datablock, "radius", "FLOAT", "POINT"), curves.point_counts(datablock)
    if stored is None or len(stored) != len(counts) * point_count:
        starts = curves.curve_offsets(datablock)
        stored = strands.resample_values(
            curves.read_radii(datablock), curves.read_points(datablock), starts, point_count
        )
    rows = stored.reshape(len(counts), point_count)
    return lambda some: attributes.valid_radii(rows[some])


def counts_per_curve(datablock):
    """Return (S,) int32: points of each curve in file formats that keep point counts.

    Polylines keep their points. Catmull-Rom splines with few points are subdivided to at least the point count of
    strands. The counts depend only on the number of points, so they are constant over time.
    """
    counts = curves.point_counts(datablock)
    return ((counts - 1) * _lines_of_segments(datablock, counts) + 1).astype(np.int32)


def points_per_curve(datablock):
    """Return (N, 3) float32 local points of curves, `counts_per_curve` for each."""
    return _per_curve(datablock, curves.read_points(datablock))


def radii_per_curve(datablock):
    """Return (N,) float32 radii in local units, at least zero, of the points of `points_per_curve`."""
    radii = _per_curve(datablock, attributes.valid_radii(curves.read_radii(datablock))[:, None])[:, 0]
    return np.maximum(radii, np.float32(0.0))


def _lines_of_segments(datablock, counts):
    """Return (S,) the number of lines for each segment of a curve."""
    is_divided = attributes.are_smooth(datablock) & (counts > 2) & (counts < groom.POINT_COUNT)
    return np.where(is_divided, -((1 - groom.POINT_COUNT) // np.maximum(counts - 1, 1)), 1)


def _per_curve(datablock, values):
    """Values (N, D) at the points of curves → (M, D) float32 at the points of `points_per_curve`."""
    counts = curves.point_counts(datablock)
    lines = _lines_of_segments(datablock, counts)
    is_divided = lines > 1
    if not is_divided.any():
        return values
    each_segment = np.repeat(lines[is_divided], counts[is_divided] - 1)
    return bezier_segments.smooth_lines(values, counts, is_divided, each_segment)[0]
