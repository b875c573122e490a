# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands between guides: weighted means of guides' offsets  ([Report12] section 2.4, Eq. 10).

With weights w_j that add up to one, o_j,i the offsets of guide j (Eq. 7) and R_j what turns the surface at its root
into the surface at the strand's, the strand is p'_0 = q and

    p'_i = p'_(i-1) + λ_i m_i,    m_i = sum_j w_j R_j o_j,i,    l_i = sum_j w_j |o_j,i|,    λ_i = l_i / |m_i|

Eq. 10 is λ_i = 1, which makes a strand shorter than its guides wherever they disagree, to nothing where they oppose
each other. With λ_i as above each segment is as long as its guides' are on average. Weights do not depend on the point
(guide_weights.py): `interpolate` is what combing repeats.

R_j is the least rotation that takes the guide's normal to the strand's: it needs no UV map and is continuous wherever
normals are. With a frame F (tangent, bitangent, normal) at either root it is F_strand Z F_guide^T, Z being a turn about
the normal. So guides are put into their frames once, a neighbour costs five multiplications a point instead of nine,
and the strand's frame is applied to the sum.
"""

from .lane_interpolation import by_lanes
from .vector_interpolation import by_vectors


def interpolate(roots, normals, guide_points, guide_normals, guide_weights, keep_length=1.0, out=None):
    """(S, P) vec3 [m]: strands at roots (S,) [m] with unit normals (S,) that follow guides (G, P) [m], normals (G,).

    keep_length: how much of the way from Eq. 10 to segments as long as the guides' on average, 0 to 1; out: array to
    fill and return, None for a new one.
    """
    by = by_vectors if roots.device.is_cpu else by_lanes
    return by(roots, normals, guide_points, guide_normals, guide_weights, keep_length, out)
