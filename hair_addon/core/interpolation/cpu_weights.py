# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights of guide_weights.py for eight guides at once, in the CPU's vector registers.

weigh.cpp and limit.cpp implement them once for both kinds of device with the vectors of lanes.h: on a GPU, whose
threads are lanes already, a vector is one number.
"""

import warp as wp

from ..kernels import native_code

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

NUMBERS = 8  # per guide


@wp.func_native(native_code.body(__file__, "weigh.cpp", WIDTH=NUMBERS))
def weigh(
    strand: int,
    nearest: float,
    reach: float,
    fall_off: float,
    tangent: wp.vec3,
    bitangent: wp.vec3,
    normal: wp.vec3,
    candidates: wp.array2d[int],
    ways: wp.array2d[float],
    frames: wp.array2d[float],
    out_indices: wp.array2d[int],
    out_weights: wp.array2d[float],
    out_turns: wp.array2d[wp.vec2],
):
    """Compute guides, weights and rotations of a strand. frames: (G, 8), tangent and normal of each guide."""


@wp.func_native(native_code.body(__file__, "guide_lengths.cpp", WIDTH=NUMBERS))
def sum_points(guide: int, guide_points: wp.array2d[wp.vec3], out_sums: wp.array2d[float]):
    """Write the sum of unit vectors to points of a guide's lower half, and its length, to (G, 8) numbers."""


@wp.func_native(native_code.body(__file__, "limit.cpp", WIDTH=NUMBERS))
def limit(
    strand: int,
    out_row: int,
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    shapes: wp.array2d[float],
    cosine_none: float,
    per_cosine: float,
    length_limit: float,
    per_length: float,
    out_weights: wp.array2d[float],
):
    """Remove guides that differ too much from a strand's weights. shapes: (G, 8) of `guide_weights._shapes`."""
