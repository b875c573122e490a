# SPDX-License-Identifier: GPL-3.0-or-later
"""Clump centers for Blender's hair nodes: the strand nearest to each guide."""

import numpy as np
import warp as wp

from ..kernels import kernel_cache
from ..kernels.checks import require_count, require_indices

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def _nearest(
    guide_index: wp.array[int],
    roots: wp.array[wp.vec3],
    guide_roots: wp.array[wp.vec3],
    # outputs
    out_squared: wp.array[float],
    out_leader: wp.array[int],
):
    # Sequential, on one core: of several strands at equal distance the first is chosen.
    for strand in range(guide_index.shape[0]):
        guide = guide_index[strand]
        squared = wp.length_sq(roots[strand] - guide_roots[guide])
        if squared < out_squared[guide]:
            out_squared[guide] = squared
            out_leader[guide] = strand


def clump_centers(guide_index: wp.array[int], roots: np.ndarray, guide_roots: np.ndarray) -> np.ndarray:
    """Return (S,) int32: for each strand, the index of the strand of the same guide whose root is nearest to it.

    guide_index: (S,) nearest guide of each strand; roots (S, 3) and guide_roots (G, 3) [m].
    """
    guide_index, roots, guide_roots = (
        wp.array(np.ascontiguousarray(array, scalar), dtype=kind, device="cpu", copy=False)
        for array, scalar, kind in (
            (guide_index, np.int32, int),
            (roots, np.float32, wp.vec3),
            (guide_roots, np.float32, wp.vec3),
        )
    )
    require_count("strands", len(guide_index), len(roots))
    require_indices("guides", guide_index.numpy(), len(guide_roots))
    squared = wp.full(len(guide_roots), wp.inf, dtype=float, device="cpu")
    leader = wp.zeros(len(guide_roots), dtype=int, device="cpu")
    kernel_cache.launch(_nearest, 1, inputs=[guide_index, roots, guide_roots], outputs=[squared, leader], device="cpu")
    return leader.numpy()[guide_index.numpy()]
