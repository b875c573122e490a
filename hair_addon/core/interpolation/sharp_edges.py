# SPDX-License-Identifier: GPL-3.0-or-later
"""Sharp edges and thin sheets: guides on another face count as farther away than they are.

With r_j the distance from a strand's root to guide j, r' the distance to the first excluded guide, and s_j = 0 for
normals that differ by less than `BEGIN`, rising to 1 at `END`:

    r_j + HOLD (r' - r_j) s_j

So a strand follows guides of its own face wherever this face has guides within r'. Otherwise it would follow guides
of the other face, turned by the angle of the edge. On smooth surfaces with few guides, normals differ so much only
near r', where weights are small. HOLD is below 1 because a strand whose guides are all on other faces still prefers
nearer guides.
"""

import math

import numpy as np
import warp as wp

from ..kernels import parallel
from ..kernels.checks import require_count, require_indices
from ..kernels.parallel import Rows

# No gradients are needed. Without fused multiply-add all devices round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

BEGIN, END = math.radians(60.0), math.radians(75.0)  # below, strands turn with their guides (interpolation.py)
HOLD = 0.98
_BEGIN_COSINE = math.cos(BEGIN)
_PER_COSINE = 1.0 / (math.cos(BEGIN) - math.cos(END))


def go_around(
    normals: wp.array[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    candidates: wp.array2d[int],
    ways: wp.array2d[float],
) -> None:
    """Lengthen paths (S, K) [m] to candidate guides (S, K) on other faces, and sort both.

    normals (S,) and guide_normals (G,): unit; the last path of a row stays as it is.
    """
    require_count("strands", len(candidates), len(normals))
    require_count("candidates", candidates.size, ways.size)
    require_indices("guides", np.maximum(candidates.numpy(), 0), len(guide_normals))
    parallel.launch(
        _go_around,
        len(normals),
        inputs=[Rows(normals), guide_normals],
        outputs=[candidates, ways],
        device=normals.device,
    )


@wp.kernel
def _go_around(
    normals: wp.array[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    # outputs
    out_candidates: wp.array2d[int],
    out_ways: wp.array2d[float],
):
    strand = wp.tid()
    normal = normals[strand]
    candidates = out_candidates[strand]
    ways = out_ways[strand]
    count = int(0)
    facing = float(1.0)
    while count < candidates.shape[0] and candidates[count] >= 0 and ways[count] < wp.inf:
        facing = wp.min(facing, wp.dot(normal, guide_normals[candidates[count]]))
        count += 1
    if count == 0 or facing >= wp.static(_BEGIN_COSINE):
        return
    reach = ways[count - 1]
    # The last path stays last: beside part lines it is shorter than some others, and not the length to its guide.
    for slot in range(count - 1):
        guide = candidates[slot]
        part = (wp.static(_BEGIN_COSINE) - wp.dot(normal, guide_normals[guide])) * wp.static(_PER_COSINE)
        part = wp.clamp(part, 0.0, 1.0)
        part = part * part * (3.0 - 2.0 * part)
        way = ways[slot] + wp.static(HOLD) * part * wp.max(reach - ways[slot], 0.0)
        # Insertion sort: paths are mostly in order, and ties stay in the order of the search.
        place = int(slot)
        while place > 0 and ways[place - 1] > way:
            ways[place] = ways[place - 1]
            candidates[place] = candidates[place - 1]
            place -= 1
        ways[place] = way
        candidates[place] = guide
