# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands that stand for many others: the middles of clusters by root and shape.

Clusters start at farthest points [Gonzalez85] and are moved by Lloyd's iterations [Lloyd82], both in the space of a
strand's root and a few of its points relative to it. Of each cluster the strand nearest to its mean is taken, so that
representatives are strands that are there.
"""

import numpy as np

_SHAPE = 0.5  # how much a distance between shapes counts beside one between roots
_SAMPLES = 4  # points of a strand that stand for its shape
_ITERATIONS = 8
_BLOCK = 4096  # strands at a time, so that their distances to all clusters stay in caches


def representatives(points: np.ndarray, count: int) -> np.ndarray:
    """Indices, at most `count` of them and rising, of strands (S, P, 3) [m] that stand for all; S > 0."""
    features = _features(points)
    if count >= len(features):
        return np.arange(len(features))
    centers = features[_farthest(features, count)]
    for _ in range(_ITERATIONS):
        nearest, _squares = _nearest(features, centers)
        sizes = np.bincount(nearest, minlength=count)
        sums = np.stack([np.bincount(nearest, column, count) for column in features.T], axis=1)
        centers = np.where(sizes[:, None] > 0, sums / np.maximum(sizes, 1)[:, None], centers).astype(np.float32)
    nearest, squares = _nearest(features, centers)
    order = np.lexsort((squares, nearest))
    _clusters, firsts = np.unique(nearest[order], return_index=True)
    return np.sort(order[firsts])


def _features(points):
    """(S, 3 + 3 k) float32: the root of each strand, and points along it relative to that."""
    along = np.rint(np.linspace(0.0, points.shape[1] - 1, _SAMPLES + 1)[1:]).astype(np.int64)
    roots = points[:, 0].astype(np.float32)
    shapes = (points[:, along] - points[:, :1]) * (_SHAPE / np.sqrt(_SAMPLES))
    return np.concatenate([roots - roots.mean(axis=0), shapes.reshape(len(points), -1)], axis=1).astype(np.float32)


def _farthest(features, count):
    """(count,) indices: each farthest from those before it; the first is nearest to the mean."""
    first = int(np.sum((features - features.mean(axis=0)) ** 2, axis=1).argmin())
    found = [first]
    nearest = np.sum((features - features[first]) ** 2, axis=1)
    for _ in range(count - 1):
        found.append(int(nearest.argmax()))
        np.minimum(nearest, np.sum((features - features[found[-1]]) ** 2, axis=1), out=nearest)
    return np.array(found)


def _nearest(features, centers):
    """(S,) the center nearest to each strand, and (S,) the squares of their distances."""
    nearest, squares = np.empty(len(features), np.int64), np.empty(len(features), np.float32)
    lengths = np.sum(centers**2, axis=1)
    for first in range(0, len(features), _BLOCK):
        some = slice(first, first + _BLOCK)
        apart = lengths - 2.0 * features[some] @ centers.T
        nearest[some] = apart.argmin(axis=1)
        squares[some] = np.sum((features[some] - centers[nearest[some]]) ** 2, axis=1)
    return nearest, squares
