# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of voxels and of nodes of strands in one array of texels: shaders/light/light_grid.glsl reads both from one
texture, as some graphics drivers have few textures.

Layers of voxels come first. Each row of the layers of nodes contains the nodes of whole strands, one after the other.
"""

import numpy as np

from ...imaging.texture_sides import avoid_powers_of_two
from .strand_nodes import NODES

_MOST_LAYERS = 2048  # which all graphics drivers allow


def sides_of(shape: tuple[int, int, int]) -> np.ndarray:
    """Return (3,) texels along X, Y, Z of the voxels of a grid of this shape (X, Y, Z)."""
    return avoid_powers_of_two(np.maximum(shape, (NODES, 1, 1)))


def packed(voxels: np.ndarray, nodes: np.ndarray | None) -> np.ndarray:
    """Return texels (Z, Y, X, 4) float32 of `voxel_means.shares` (Z, Y, X, 4) and `NodeSums.texels` (S, NODES, 4), if
    there are any and texture sizes allow.
    """
    width, height, depth = sides_of(voxels.shape[2::-1])
    beside = np.array((depth, height, width)) - voxels.shape[:3]
    texels = np.pad(voxels, [*((0, int(more)) for more in beside), (0, 0)], mode="edge")
    in_row = int(width) // NODES
    layers = 0 if nodes is None else -(-len(nodes) // (in_row * int(height)))
    total = int(avoid_powers_of_two(int(depth) + layers))
    if not layers or total > _MOST_LAYERS:
        return texels
    of_nodes = np.zeros((total - int(depth), height, width, 4), np.float32)
    whole = np.zeros((len(of_nodes) * int(height) * in_row, NODES, 4), np.float32)
    whole[: len(nodes)] = nodes
    of_nodes[:, :, : in_row * NODES] = whole.reshape(len(of_nodes), height, in_row * NODES, 4)
    return np.concatenate([texels, of_nodes])
