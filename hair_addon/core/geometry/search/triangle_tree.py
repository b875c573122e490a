# SPDX-License-Identifier: GPL-3.0-or-later
"""A tree of boxes around triangles, for graphics cards: complete and binary, so that nodes need no links.

Node 1 is the root, nodes 2 n and 2 n + 1 are the halves of node n. CPU and CUDA use Warp's own tree.
"""

import numpy as np

LEAF_TRIANGLES = 4


def build(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (boxes (2 L, 2, 3) float32, triangles (L, LEAF_TRIANGLES) int32 of each leaf) of triangles (F, 3, 3).

    F > 0; L is a power of two; the list of triangles is filled up with repetitions of the last one. boxes[n]: least and
    greatest coordinates of node n.
    """
    corners = np.asarray(corners, np.float32)
    leaf_count = 1 << int(np.ceil(np.log2(max(-(-len(corners) // LEAF_TRIANGLES), 1))))
    order = np.minimum(np.arange(leaf_count * LEAF_TRIANGLES), len(corners) - 1)
    middles = corners.mean(axis=1)
    node_count = 1
    while node_count < leaf_count:  # each node is halved at its median triangle, along its longest side
        places = middles[order].reshape(node_count, -1, 3)
        along = np.ptp(places, axis=1).argmax(axis=1)
        places = np.take_along_axis(places, along[:, None, None], axis=2)[..., 0]
        order = np.take_along_axis(order.reshape(node_count, -1), places.argsort(axis=1, kind="stable"), axis=1).ravel()
        node_count *= 2
    boxes = np.zeros((2 * leaf_count, 2, 3), np.float32)
    leaves = corners[order].reshape(leaf_count, -1, 3)
    boxes[leaf_count:] = np.stack([leaves.min(axis=1), leaves.max(axis=1)], axis=1)
    while node_count > 1:
        node_count //= 2
        halves = boxes[2 * node_count : 4 * node_count].reshape(node_count, 2, 2, 3)
        boxes[node_count : 2 * node_count] = np.stack(
            [halves[:, :, 0].min(axis=1), halves[:, :, 1].max(axis=1)], axis=1
        )
    return boxes, order.reshape(leaf_count, LEAF_TRIANGLES).astype(np.int32)
