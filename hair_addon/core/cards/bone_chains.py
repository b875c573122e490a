# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains of bones along hair, which game engines swing, and the weights of cards and tubes on them."""

import numpy as np

from ..errors import HairError
from ..geometry.search import clusters

_TINY = 1e-12


def chains(points: np.ndarray, chain_count: int, bone_count: int) -> np.ndarray:
    """Return joints (C, bone_count + 1, 3) float64 of chains from root to tip: the middle lines of clumps of strands.

    points: (S, P, 3) of strands, with S at least C. Bones of a chain are equally long. Raises `HairError`.
    """
    if not np.isfinite(points).all():
        raise HairError("Some strands have non-finite coordinates: regenerate the hair.")
    labels = clusters.clusters(clusters.strand_features(points), chain_count)
    lines = clusters.cluster_means(points, labels, chain_count)
    places = np.linspace(0.0, 1.0, bone_count + 1)
    return np.stack([_resampled(line, places) for line in lines])


def _resampled(line, places):
    """Return points at fractions (n,) of the arc length of a line (P, 3)."""
    along = arc_lengths(line[None])[0]
    wanted = places * along[-1]
    return np.stack([np.interp(wanted, along, line[:, axis]) for axis in range(3)], axis=1)


def arc_lengths(lines: np.ndarray) -> np.ndarray:
    """Return arc lengths (N, n) from the first point of lines (N, n, 3)."""
    lengths = np.linalg.norm(np.diff(lines.astype(np.float64), axis=1), axis=-1)
    return np.concatenate([np.zeros((len(lines), 1)), np.cumsum(lengths, axis=1)], axis=1)


def nearest_chains(lines: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """Return the index (N,) of the chain most similar to each line (N, n, 3) at root, thirds and tip."""
    own, of_chains = clusters.strand_features(lines), clusters.strand_features(joints)
    squares = np.stack([((own - features) ** 2).sum(axis=1) for features in of_chains])
    return squares.argmin(axis=0)


def weights(lines: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """Return weights (N, n, bone_count + 1) of points of lines (N, n, 3) on their chains (N, bone_count + 1, 3).

    The first weight belongs to the root bone, which does not swing. Points at the root follow only the root bone,
    points at the end of a bone follow only this bone, and points between follow a mixture. Points beyond the chain
    follow the last bone.
    """
    bone_count = joints.shape[1] - 1
    lengths = np.maximum(arc_lengths(joints)[:, -1:], _TINY)
    along = bone_count * np.minimum(arc_lengths(lines) / lengths, 1.0)
    return np.maximum(1.0 - np.abs(along[..., None] - np.arange(bone_count + 1)), 0.0)
