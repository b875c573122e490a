# SPDX-License-Identifier: GPL-3.0-or-later
"""Representative strands: medoids of clusters by root and shape.

The representative of a cluster is the strand closest to its mean, and thus an existing strand.
"""

import numpy as np

from ..geometry import clusters

_SHAPE = 0.5  # weight of distances between shapes relative to distances between roots
_SAMPLES = 4  # points of a strand that describe its shape


def representatives(points: np.ndarray, count: int) -> np.ndarray:
    """Return ascending indices, at most `count`, of representatives of strands (S, P, 3) [m]; S > 0."""
    features = _features(points)
    if count >= len(features):
        return np.arange(len(features))
    return np.sort(clusters.medoids(features, clusters.clusters(features, count), count))


def _features(points):
    """Return features (S, 3 + 3 k) float32: the root of each strand, and points along it relative to the root."""
    along = np.rint(np.linspace(0.0, points.shape[1] - 1, _SAMPLES + 1)[1:]).astype(np.int64)
    roots = points[:, 0].astype(np.float32)
    shapes = (points[:, along] - points[:, :1]) * (_SHAPE / np.sqrt(_SAMPLES))
    return np.concatenate([roots - roots.mean(axis=0), shapes.reshape(len(points), -1)], axis=1).astype(np.float32)
