# SPDX-License-Identifier: GPL-3.0-or-later
"""Which strand stands for the guide that others follow: the middle of their clump in Blender's hair nodes."""

import numpy as np


def leaders(guide_index, roots, guide_roots):
    """(S,) int32: for each strand the index of the strand that is rooted nearest to its guide, among the guide's own.

    guide_index: (S,) the guide that each strand follows first; roots (S, 3) and guide_roots (G, 3) [m].
    """
    apart = np.linalg.norm(roots - guide_roots[guide_index], axis=1)
    nearest = np.full(len(guide_roots), np.inf, apart.dtype)
    np.minimum.at(nearest, guide_index, apart)
    candidates = np.flatnonzero(apart == nearest[guide_index])
    leader = np.zeros(len(guide_roots), np.int32)
    leader[guide_index[candidates[::-1]]] = candidates[::-1]  # of several in one place the first
    return leader[guide_index]
