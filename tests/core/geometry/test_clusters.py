# SPDX-License-Identifier: GPL-3.0-or-later
"""No cluster is empty, each row is in the nearest cluster, and separate groups are found."""

import numpy as np
import pytest

from hair_addon.core.errors import HairError
from hair_addon.core.geometry.search import clusters


@pytest.mark.parametrize("count", [1, 7, 64, 300])
def test_no_cluster_is_empty(rng, count):
    labels = clusters.clusters(rng.random((300, 12), np.float32), count)
    assert sorted(set(labels)) == list(range(count))


def test_equal_rows_still_fill_every_cluster():
    assert sorted(clusters.clusters(np.zeros((20, 3), np.float32), 20)) == list(range(20))


def test_rows_lie_nearer_to_their_mean_than_a_random_division(rng):
    features = rng.random((2000, 3), np.float32)
    labels = clusters.clusters(features, 50)
    means = clusters.cluster_means(features, labels, 50)
    squares = ((features[:, None] - means[None]) ** 2).sum(axis=-1)
    assert (squares.argmin(axis=1) == labels).mean() > 0.95
    # Cubes of the same number would have a sixth of their squared side for each row's squared distance.
    assert squares.min(axis=1).mean() < 1.15 * 3 / 12 * (1 / 50) ** (2 / 3)


def test_groups_that_stand_apart_are_found(rng):
    middles = 10.0 * np.array([[x, y, 0.0] for x in range(4) for y in range(4)])
    of_row = np.repeat(rng.permutation(16), 40)
    labels = clusters.clusters((middles[of_row] + rng.random((640, 3))).astype(np.float32), 16)
    assert len(set(zip(of_row, labels, strict=True))) == 16


def test_a_medoid_is_a_row_of_its_cluster_and_the_nearest(rng):
    features = rng.random((200, 4), np.float32)
    labels = clusters.clusters(features, 9)
    chosen = clusters.medoids(features, labels, 9)
    means = clusters.cluster_means(features, labels, 9)
    for cluster, row in enumerate(chosen):
        rows = np.flatnonzero(labels == cluster)
        distances = np.linalg.norm(features[rows] - means[cluster], axis=1)
        assert row == rows[distances.argmin()]


def test_more_clusters_than_rows_are_refused():
    with pytest.raises(HairError, match="3 strands cannot form 4 clumps"):
        clusters.clusters(np.zeros((3, 2), np.float32), 4)


def test_rows_far_from_the_origin_are_divided_as_near_it(rng):
    """Rows far from the origin are divided as near it, for numbers that single precision holds exactly in both
    places.
    """
    features = rng.integers(0, 1024, (200, 12)).astype(np.float32) / 1024.0
    np.testing.assert_array_equal(clusters.clusters(features + 4096.0, 20), clusters.clusters(features, 20))
