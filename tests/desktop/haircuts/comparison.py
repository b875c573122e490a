# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances between curves and the curves with the nearest roots."""

import numpy as np
from mathutils.kdtree import KDTree


def distances(found, others, nearest=1):
    """Return (S,) mean distances between points of curves (S, P, 3) and of the others (T, P, 3) with the nearest roots,
    relative to their lengths.

    nearest: 1 for the nearest, 2 for the second.
    """
    tree = KDTree(len(others))
    for number, curve in enumerate(others):
        tree.insert(curve[0], number)
    tree.balance()
    near = others[[tree.find_n(curve[0], nearest)[-1][1] for curve in found]]
    apart = np.linalg.norm((found - found[:, :1]) - (near - near[:, :1]), axis=2).mean(axis=1)
    return apart / np.linalg.norm(np.diff(found, axis=1), axis=2).sum(axis=1)
