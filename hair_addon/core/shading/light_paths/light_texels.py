# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of voxels and of nodes, the sample points along strands, in one array of texels.

shaders/light/light_grid.glsl reads both from one texture, because some graphics drivers allow few textures.

Layers of voxels come first. Each row of the layers of nodes contains the nodes of whole strands, one after the other.
The last texel contains the number of nodes per strand.
"""

import numpy as np

from ...texture_sides import avoid_powers_of_two

MOST_OF_STRAND = 64  # nodes
_MOST_LAYERS = 2048  # which all graphics drivers allow
_MOST_WIDENED = 500_000  # texels of a grid that is wider than its voxels


def sides_of(shape: tuple[int, int, int]) -> np.ndarray:
    """Return (3,) texels along X, Y, Z of the voxels of a grid of this shape (X, Y, Z).

    Nodes of a strand are in a row along X, so grids of hair that is narrow along X are wider than their voxels.
    """
    least = min(MOST_OF_STRAND, _MOST_WIDENED // (shape[1] * shape[2]))
    return avoid_powers_of_two((max(shape[0], least), *shape[1:]))


def packed(voxels: np.ndarray, nodes: np.ndarray | None) -> np.ndarray:
    """Return texels (Z, Y, X, 4) float32 of `voxel_means.shares` (Z, Y, X, 4) and `NodeSums.texels` (S, nodes, 4), if
    there are any and texture sizes allow.
    """
    width, height, depth = sides_of(voxels.shape[2::-1]).tolist()
    beside = np.array((depth, height, width)) - voxels.shape[:3]
    texels = np.pad(voxels, [*((0, int(more)) for more in beside), (0, 0)], mode="edge")
    if nodes is None:
        return texels
    in_row = width // nodes.shape[1]
    rows = -(-len(nodes) // max(in_row, 1)) + 1  # also for the last texel
    total = int(avoid_powers_of_two(depth - (-rows // height)))
    if not in_row or total > _MOST_LAYERS:
        return texels
    of_nodes = np.zeros(((total - depth) * height, width, 4), np.float32)
    whole = np.zeros((len(of_nodes) * in_row, *nodes.shape[1:]), np.float32)
    whole[: len(nodes)] = nodes
    of_nodes[:, : in_row * nodes.shape[1]] = whole.reshape(len(of_nodes), -1, 4)
    of_nodes[-1, -1] = nodes.shape[1]
    return np.concatenate([texels, of_nodes.reshape(-1, height, width, 4)])
