# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums over paths by voxel → means without holes: where there are few paths, those of larger voxels count as well."""

import numpy as np

_PRIOR = 16.0  # paths that the mean of the voxels around stands for


def smooth_means(sums: np.ndarray) -> np.ndarray:
    """(Z, Y, X, 4) sums of RGB and their count → (Z, Y, X, 3) means; black where there is nothing at all.

    From large voxels to small ones each mean is drawn to that of the voxel around it, by a fixed number of paths.
    """
    levels = [np.asarray(sums, np.float64)]
    while max(levels[-1].shape[:3]) > 1:
        levels.append(_halved(levels[-1]))
    total = levels.pop()
    means = total[..., :3] / np.maximum(total[..., 3:], 1.0)
    for level in reversed(levels):
        around = _doubled(means, level.shape)
        means = (level[..., :3] + _PRIOR * around) / (level[..., 3:] + _PRIOR)
    return means


def _halved(sums):
    """Sums over blocks of 2 × 2 × 2 voxels."""
    padded = np.pad(sums, [(0, length % 2) for length in sums.shape[:3]] + [(0, 0)])
    z, y, x = (length // 2 for length in padded.shape[:3])
    return padded.reshape(z, 2, y, 2, x, 2, 4).sum(axis=(1, 3, 5))


def _doubled(values, shape):
    """Values (..., 3) of voxels at the centres of those of half the size, linear between them."""
    for axis in range(3):
        places = 0.5 * (np.arange(shape[axis]) + 0.5) - 0.5
        below = np.clip(np.floor(places).astype(int), 0, values.shape[axis] - 1)
        above = np.minimum(below + 1, values.shape[axis] - 1)
        part = np.clip(places - below, 0.0, 1.0).reshape([-1 if axis == one else 1 for one in range(4)])
        values = np.take(values, below, axis) * (1.0 - part) + np.take(values, above, axis) * part
    return values
