# SPDX-License-Identifier: GPL-3.0-or-later
"""Each sample shows the nearest triangle, and a texture hides triangles in proportion to its coverage."""

import numpy as np
import pytest

from hair_addon.core.cards.nearest_triangles import NONE, Samples
from hair_addon.core.errors import HairError

SIZE = 48


def by_brute_force(corners):
    """Return the nearest triangle of each sample."""
    y, x = (np.indices((SIZE, SIZE)) + 0.5).astype(float)
    nearest, least = np.full((SIZE, SIZE), NONE), np.full((SIZE, SIZE), np.inf)
    for index, triangle in enumerate(corners):
        edges = np.stack([triangle[1, :2] - triangle[0, :2], triangle[2, :2] - triangle[0, :2]], axis=1)
        second, third = np.einsum("ij,jyx->iyx", np.linalg.inv(edges), np.stack([x, y]) - triangle[0, :2, None, None])
        depth = (1.0 - second - third) * triangle[0, 2] + second * triangle[1, 2] + third * triangle[2, 2]
        is_nearer = (second > 0.0) & (third > 0.0) & (second + third < 1.0) & (depth < least)
        nearest[is_nearer], least[is_nearer] = index, depth[is_nearer]
    return nearest


def test_samples_show_the_nearest_triangle_in_any_order(rng):
    """Samples equal brute force, also if triangles reach beyond the picture or are added in parts."""
    corners = rng.uniform(-10.0, SIZE + 10.0, (40, 3, 3))
    corners[..., 2] = rng.random((40, 3))
    samples = Samples(SIZE)
    samples.add(corners[:15])
    samples.add(corners[15:])
    wanted = by_brute_force(corners)
    assert (samples.triangles() == wanted).mean() > 0.998 and (wanted != NONE).mean() > 0.5
    order = rng.permutation(40)
    again = Samples(SIZE)
    again.add(corners[order])
    assert (np.append(order, NONE)[again.triangles()] == samples.triangles()).all()


@pytest.mark.parametrize("part", [0.0, 0.3, 1.0])
def test_a_texture_covers_its_part_of_the_samples(part):
    corners = np.array([[[0, 0, 0.5], [2 * SIZE, 0, 0.5], [0, 2 * SIZE, 0.5]]], float)
    uvs = np.array([[[0, 0], [1, 0], [0, 1]]], float)
    samples = Samples(SIZE)
    samples.add(corners, uvs, np.full((8, 8), part))
    assert (samples.triangles() == 0).mean() == pytest.approx(part, abs=0.03 * (0.0 < part < 1.0))


def test_textures_are_sampled_at_their_coordinates():
    """A texture that covers the left half hides the right half."""
    corners = np.array([[[0, 0, 0], [SIZE, 0, 0], [SIZE, SIZE, 0]], [[0, 0, 0], [SIZE, SIZE, 0], [0, SIZE, 0]]], float)
    alpha = np.zeros((4, 4))
    alpha[:, :2] = 1.0
    samples = Samples(SIZE)
    samples.add(corners, corners[..., :2] / SIZE, alpha)
    wanted = np.broadcast_to(np.arange(SIZE) < SIZE // 2, (SIZE, SIZE))
    np.testing.assert_array_equal(samples.triangles() != NONE, wanted)


def test_other_than_finite_coordinates_are_refused():
    with pytest.raises(HairError, match="non-finite"):
        Samples(SIZE).add(np.full((1, 3, 3), np.nan))
    with pytest.raises(HairError, match="texture coordinates"):
        Samples(SIZE).add(np.zeros((2, 3, 3)), np.zeros((1, 3, 2)), np.ones((2, 2)))
