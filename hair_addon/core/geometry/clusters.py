# SPDX-License-Identifier: GPL-3.0-or-later
"""Clusters of alike rows of numbers: k-means [Lloyd82] from a balanced division into boxes."""

import numpy as np

from ..errors import HairError
from ..long_work import Progress, no_progress, part_of

_ROUNDS = 8
_AT_ONCE = 4_000_000  # distances


def strand_features(points: np.ndarray) -> np.ndarray:
    """(S, P, 3) points [m] → (S, 12) float32: where strands are at the root, at both thirds and at the tip."""
    chosen = np.round(np.linspace(0.0, points.shape[1] - 1, 4)).astype(int)
    return np.ascontiguousarray(points[:, chosen].reshape(len(points), -1), np.float32)


def clusters(features: np.ndarray, count: int, progress: Progress = no_progress) -> np.ndarray:
    """(N, D) features → (N,) int32 labels below `count`, each of which some row has. Raises `HairError`.

    The same for the same rows in the same order: nothing is random.
    """
    if not 1 <= count <= len(features):
        raise HairError("{rows} strands cannot form {count} clumps.", rows=len(features), count=count)
    # Squares of coordinates far from the origin would leave nothing of the distances between.
    features = features - features.mean(axis=0, dtype=np.float64).astype(np.float32)
    labels = _boxes(features, count)
    for turn in range(_ROUNDS):
        centres = cluster_means(features, labels, count)
        told = part_of(progress, turn / _ROUNDS, (turn + 1) / _ROUNDS)
        nearest, squares = _nearest(features, centres, told)
        changed = _without_empty(nearest, squares, count)
        if np.array_equal(changed, labels):
            break
        labels = changed
    return labels


def cluster_means(values: np.ndarray, labels: np.ndarray, count: int) -> np.ndarray:
    """Means of (N, ...) values over rows of the same label, (count, ...) float64; every label has some row."""
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(count))
    sizes = np.diff(np.append(starts, len(labels)))
    sums = np.add.reduceat(values[order].astype(np.float64), starts, axis=0)
    return sums / sizes.reshape(-1, *[1] * (values.ndim - 1))


def medoids(features: np.ndarray, labels: np.ndarray, count: int) -> np.ndarray:
    """(count,) index of the row that is nearest to the mean of each cluster."""
    squares = ((features - cluster_means(features, labels, count)[labels]) ** 2).sum(axis=1)
    order = np.lexsort((squares, labels))
    return order[np.searchsorted(labels[order], np.arange(count))]


def _boxes(features, count):
    """Labels by halving along the widest extent, in proportion to the clusters that each half is to have."""
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
    """(N,) label of the nearest of (K, D) centres, and (N,) squares of distances."""
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
    """Labels of which none is missing: the rows farthest from their centre, of clusters with others, take those."""
    sizes = np.bincount(labels, minlength=count)
    missing = list(np.flatnonzero(sizes == 0))
    for row in np.argsort(-squares, kind="stable"):
        if not missing:
            break
        if sizes[labels[row]] > 1:
            sizes[labels[row]] -= 1
            labels[row] = missing.pop()
    return labels
