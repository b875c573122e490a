# SPDX-License-Identifier: GPL-3.0-or-later
"""Validity of meshes: an importer may create invalid meshes from damaged files."""

import numpy as np


def is_whole(mesh):
    """Whether all corner and vertex indices of a mesh's faces are valid."""
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    starts, totals = (np.empty(len(mesh.polygons), np.int32) for _ in range(2))
    mesh.polygons.foreach_get("loop_start", starts)
    mesh.polygons.foreach_get("loop_total", totals)
    ends = starts.astype(np.int64) + totals
    is_whole = corners.min(initial=0) >= 0 and corners.max(initial=-1) < len(mesh.vertices)
    return is_whole and min(starts.min(initial=0), totals.min(initial=0)) >= 0 and ends.max(initial=0) <= len(corners)
