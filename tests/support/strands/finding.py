# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides and weights of strands in one call."""

from hair_addon.core.interpolation import guide_weights


def find_guides(roots, normals, guide_roots, guide_normals, influence_distance, neighbour_limit, **parting):
    """Return `GuideWeights` as `groom.bind_hair` makes them; arguments of `find_candidates` and `weigh`."""
    candidates = guide_weights.find_candidates(roots, normals, guide_roots, guide_normals, neighbour_limit, **parting)
    return guide_weights.weigh(candidates, normals, guide_normals, influence_distance, neighbour_limit)
