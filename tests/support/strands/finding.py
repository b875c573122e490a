# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and weights of strands, and strands between guides, in one call."""

import numpy as np
import warp as wp

from hair_addon.core.interpolation import guide_weights, interpolation
from tests.support.devices import DEVICE


def find_guides(roots, normals, guide_roots, guide_normals, influence_distance, neighbour_limit, **parting):
    """Return `GuideWeights` as `groom.bind_hair` makes them; arguments of `find_candidates` and `weigh`."""
    candidates = guide_weights.find_candidates(roots, normals, guide_roots, guide_normals, neighbour_limit, **parting)
    return guide_weights.weigh(candidates, normals, guide_normals, influence_distance, neighbour_limit)


def strands_between(roots, normals, guides, guide_normals, distance=None, limit=8, keep_length=1.0):
    """Return points (S, P, 3) at roots (S, 3) by all stages; guides (G, P, 3)."""
    roots, normals, guides, guide_normals = (
        wp.array(np.float32(array), dtype=wp.vec3, device=DEVICE) for array in (roots, normals, guides, guide_normals)
    )
    weights = find_guides(roots, normals, guides[:, 0].contiguous(), guide_normals, distance, limit)
    return interpolation.interpolate(roots, normals, guides, guide_normals, weights, keep_length).numpy()
