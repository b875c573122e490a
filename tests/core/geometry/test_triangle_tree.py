# SPDX-License-Identifier: GPL-3.0-or-later
"""Every triangle is in a leaf of the tree, and every box contains the boxes and triangles below it."""

import numpy as np
import pytest

from hair_addon.core.geometry.search import triangle_tree


@pytest.mark.parametrize("count", [1, 4, 5, 1000])
def test_boxes_hold_the_triangles_below_them(rng, count):
    corners = rng.normal(size=(count, 3, 3)).astype(np.float32)
    boxes, leaves = triangle_tree.build(corners)
    leaf_count = len(leaves)
    assert np.unique(leaves).tolist() == list(range(count))
    assert boxes.shape == (2 * leaf_count, 2, 3)
    points = corners[leaves].reshape(leaf_count, -1, 3)
    np.testing.assert_array_equal(boxes[leaf_count:, 0], points.min(axis=1))
    np.testing.assert_array_equal(boxes[leaf_count:, 1], points.max(axis=1))
    for node in range(1, leaf_count):
        halves = boxes[2 * node : 2 * node + 2]
        np.testing.assert_array_equal(boxes[node], [halves[:, 0].min(axis=0), halves[:, 1].max(axis=0)])


def test_boxes_shrink_towards_the_leaves(rng):
    """Boxes shrink towards the leaves: the areas of all leaves' boxes are a few times those of their triangles."""
    corners = (rng.uniform(size=(4096, 1, 3)) + rng.normal(scale=1e-3, size=(4096, 3, 3))).astype(np.float32)
    boxes, leaves = triangle_tree.build(corners)
    sizes = np.ptp(boxes[len(leaves) :], axis=1)
    assert np.median(sizes.max(axis=1)) < 0.2
