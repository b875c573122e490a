# SPDX-License-Identifier: GPL-3.0-or-later
"""Strands whose points are all outside for certain, found without a search, eight points at a time on a CPU."""

import warp as wp

from ...kernels import native_code
from .distance_grid import DistanceGrid

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


# Returns 1 if no point of a strand needs a search, otherwise 0; known: as in `outside._keep_outside`.
@wp.func_native(native_code.body(__file__, "free_points.cpp", WIDTH=8))
def is_free(
    strand: int,
    row: int,
    first_moved: int,
    points: wp.array2d[wp.vec3],
    axes: wp.mat33d,
    shift: wp.vec3d,
    grid: DistanceGrid,
    largest_distance: float,
    known: wp.array2d[wp.vec4],
) -> int: ...
