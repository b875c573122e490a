# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that stand for many others: the middles of clusters by root and shape.

Of each cluster the strand nearest to its mean is taken, so that representatives are strands that are there.
"""

import numpy as np

from ..geometry import clusters

_SHAPE = 0.5  # how much a distance between shapes counts beside one between roots
_SAMPLES = 4  # points of a strand that stand for its shape


def representatives(points: np.ndarray, count: int) -> np.ndarray:
    """Indices, at most `count` of them and rising, of strands (S, P, 3) [m] that stand for all; S > 0."""
    features = _features(points)
    if count >= len(features):
        return np.arange(len(features))
    return np.sort(clusters.medoids(features, clusters.clusters(features, count), count))


def _features(points):
    """(S, 3 + 3 k) float32: the root of each strand, and points along it relative to that."""
    along = np.rint(np.linspace(0.0, points.shape[1] - 1, _SAMPLES + 1)[1:]).astype(np.int64)
    roots = points[:, 0].astype(np.float32)
    shapes = (points[:, along] - points[:, :1]) * (_SHAPE / np.sqrt(_SAMPLES))
    return np.concatenate([roots - roots.mean(axis=0), shapes.reshape(len(points), -1)], axis=1).astype(np.float32)
