# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights ↔ vertex groups of mesh objects."""

import numpy as np
from bpy.types import Object, VertexGroup


def has_weights(mesh_object: Object, name: str) -> bool:
    """Whether any vertex of a mesh object has a positive weight in a vertex group."""
    index = mesh_object.vertex_groups[name].index
    return any(
        member.group == index and member.weight > 0.0
        for vertex in mesh_object.data.vertices
        for member in vertex.groups
    )


def paint(group: VertexGroup, weights: np.ndarray, leaves_out_zero: bool = True) -> None:
    """Assign (V,) weights from 0 to 1 to a vertex group; leaves_out_zero: vertices with zero weight are not added."""
    order = np.argsort(weights, kind="stable")
    if leaves_out_zero:
        order = order[np.count_nonzero(weights <= 0.0) :]
    levels, starts, counts = np.unique(weights[order], return_index=True, return_counts=True)
    for level, first, count in zip(levels, starts, counts, strict=True):
        group.add(order[first : first + count].tolist(), float(level), "REPLACE")
