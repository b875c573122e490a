# SPDX-License-Identifier: GPL-3.0-or-later
"""Clusters of similar rows: k-means [Lloyd82], initialized by a balanced division into boxes."""

import numpy as np

from ...errors import HairError
from ...long_work import Progress, no_progress, part_of

_ROUNDS = 8
_AT_ONCE = 4_000_000  # distances in a batch


def strand_features(points: np.ndarray) -> np.ndarray:
    """Return features (S, 12) float32 of points (S, P, 3) [m]: positions at the root, both thirds and the tip."""
    chosen = np.round(np.linspace(0.0, points.shape[1] - 1, 4)).astype(int)
    return np.ascontiguousarray(points[:, chosen].reshape(len(points), -1), np.float32)


def clusters(features: np.ndarray, count: int, progress: Progress = no_progress) -> np.ndarray:
    """Return labels (N,) int32 in [0, count) of features (N, D), each used. Deterministic. Raises `HairError`."""
    if not 1 <= count <= len(features):
        raise HairError("{rows} strands cannot form {count} clumps.", rows=len(features), count=count)
    # Far from the origin, squared coordinates would cancel the distances between rows.
    features = features - features.mean(axis=0, dtype=np.float64).astype(np.float32)
    labels = _boxes(features, count)
    for turn in range(_ROUNDS):
        centres = cluster_means(features, labels, count)
        round_progress = part_of(progress, turn / _ROUNDS, (turn + 1) / _ROUNDS)
        nearest, squares = _nearest(features, centres, round_progress)
        changed = _without_empty(nearest, squares, count)
        if np.array_equal(changed, labels):
            break
        labels = changed
    return labels


def cluster_means(values: np.ndarray, labels: np.ndarray, count: int) -> np.ndarray:
    """Return the means (count, ...) float64 of values (N, ...) over each label; no label may be empty."""
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(count))
    sizes = np.diff(np.append(starts, len(labels)))
    sums = np.add.reduceat(values[order].astype(np.float64), starts, axis=0)
    return sums / sizes.reshape(-1, *[1] * (values.ndim - 1))


def medoids(features: np.ndarray, labels: np.ndarray, count: int) -> np.ndarray:
    """Return the index (count,) of the row closest to the mean of each cluster."""
    squares = ((features - cluster_means(features, labels, count)[labels]) ** 2).sum(axis=1)
    order = np.lexsort((squares, labels))
    return order[np.searchsorted(labels[order], np.arange(count))]


def nearest(features: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Return the index (N,) int32 of the closest of middles (K, D) to each of features (N, D)."""
    origin = middles.mean(axis=0)
    return _nearest((features - origin).astype(np.float32), middles - origin, no_progress)[0]


def _boxes(features, count):
    """Return labels by recursive division along the widest extent, in proportion to the clusters of each part."""
    labels, parts, first = np.empty(len(features), np.int32), [(np.arange(len(features)), count)], 0
    while parts:
        rows, wanted = parts.pop()
        if wanted == 1:
            labels[rows] = first
            first += 1
            continue
        values = features[rows]
        axis = int(np.argmax(np.ptp(values, axis=0)))
        left = wanted // 2
        middle = len(rows) * left // wanted
        order = np.argsort(values[:, axis], kind="stable")
        parts += [(rows[order[middle:]], wanted - left), (rows[order[:middle]], left)]
    return labels


def _nearest(features, centres, progress):
    """Return the label (N,) of the closest of the centers (K, D), and squared distances (N,)."""
    centres = centres.astype(np.float32)
    labels, squares = np.empty(len(features), np.int32), np.empty(len(features), np.float32)
    halves, step = 0.5 * (centres**2).sum(axis=1), max(_AT_ONCE // len(centres), 1)
    for first in range(0, len(features), step):
        progress("Clustering strands", first / len(features))
        rows = features[first : first + step]
        found = np.argmin(halves - rows @ centres.T, axis=1)
        labels[first : first + step] = found
        squares[first : first + step] = ((rows - centres[found]) ** 2).sum(axis=1)
    return labels, squares


def _without_empty(labels, squares, count):
    """Fill empty clusters with the rows farthest from centers, from clusters of several rows; return the labels."""
    sizes = np.bincount(labels, minlength=count)
    missing = list(np.flatnonzero(sizes == 0))
    for row in np.argsort(-squares, kind="stable"):
        if not missing:
            break
        if sizes[labels[row]] > 1:
            sizes[labels[row]] -= 1
            labels[row] = missing.pop()
    return labels
