# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights ↔ vertex groups of mesh objects."""

import numpy as np
from bpy.types import Object, VertexGroup


def has_weights(mesh_object: Object, name: str) -> bool:
    """Whether some vertex of a mesh object has a weight above zero in a vertex group."""
    index = mesh_object.vertex_groups[name].index
    return any(
        member.group == index and member.weight > 0.0
        for vertex in mesh_object.data.vertices
        for member in vertex.groups
    )


def paint(group: VertexGroup, weights: np.ndarray, leaves_out_zero: bool = True) -> None:
    """Give a vertex group weights (V,) of 0 to 1; with leaves_out_zero vertices of no weight stay outside."""
    order = np.argsort(weights, kind="stable")
    if leaves_out_zero:
        order = order[np.count_nonzero(weights <= 0.0) :]
    levels, starts, counts = np.unique(weights[order], return_index=True, return_counts=True)
    for level, first, count in zip(levels, starts, counts, strict=True):  # none where nothing has weight
        group.add(order[first : first + count].tolist(), float(level), "REPLACE")
