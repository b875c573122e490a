# SPDX-License-Identifier: GPL-3.0-or-later
"""CPU implementation of interpolation.py: eight segments of a strand at once, in vector registers.

cpu_interpolation.cpp is written in Clang's vectors, which Warp compiles for the processor that it runs on: AVX, NEON.
Sums stay in registers over all guides, segments are added up to points by a scan over lanes [Harris07], and a strand
is written once.
"""

import warp as wp

from ..geometry.hash_grid import LIMIT
from ..kernels import native_code, parallel
from ..kernels.parallel import Rows
from .gpu_interpolation import CANCELLED, LONGEST, framed_offset
from .guide_weights import GuideWeights, frame

wp.set_module_options({"enable_backward": False})

LANES = 8


@wp.func_native(
    native_code.body(
        __file__, "cpu_interpolation.cpp", LANES=LANES, SLOT_LIMIT=LIMIT, CANCELLED=CANCELLED, LONGEST=LONGEST
    )
)
def _sum_in_vectors(
    strand: int,
    root: wp.vec3,
    tangent: wp.vec3,
    bitangent: wp.vec3,
    normal: wp.vec3,
    offsets: wp.array3d[float],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    keep_length: float,
    out_points: wp.array2d[wp.vec3],
): ...


@wp.kernel
def _strands_in_vectors(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    offsets: wp.array3d[float],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    keep_length: float,
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    strand = wp.tid()
    normal = normals[strand]
    tangent, bitangent = frame(normal)
    _sum_in_vectors(
        strand,
        roots[strand],
        tangent,
        bitangent,
        normal,
        offsets,
        indices,
        weights,
        turns,
        keep_length,
        out_points,
    )


@wp.kernel
def _offsets_in_vectors(
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    # outputs
    out_offsets: wp.array3d[float],
):
    guide = wp.tid()
    for group in range(out_offsets.shape[1]):
        for lane in range(wp.static(LANES)):
            offset = framed_offset(guide_points, guide, 1 + wp.static(LANES) * group + lane, guide_normals[guide])
            for part in range(4):
                out_offsets[guide, group, wp.static(LANES) * part + lane] = offset[part]


def by_vectors(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    guide_weights: GuideWeights,
    keep_length: float = 1.0,
    out: wp.array2d[wp.vec3] | None = None,
) -> wp.array2d[wp.vec3]:
    """What `interpolation.interpolate` returns; all arrays on the processor."""
    guide_count, point_count = guide_points.shape
    group_count = -(-(point_count - 1) // LANES)
    offsets = wp.empty((guide_count, group_count, 4 * LANES), dtype=float, device=roots.device)
    parallel.launch(
        _offsets_in_vectors,
        guide_count,
        inputs=[Rows(guide_points), Rows(guide_normals)],
        outputs=[offsets],
        device=roots.device,
        least_rows=256,
    )
    points = parallel.empty_vectors((len(roots), point_count), roots.device) if out is None else out
    parallel.launch(
        _strands_in_vectors,
        len(roots),
        inputs=[
            Rows(roots),
            Rows(normals),
            offsets,
            Rows(guide_weights.indices),
            Rows(guide_weights.weights),
            Rows(guide_weights.turns),
            keep_length,
        ],
        outputs=[points],
        device=roots.device,
    )
    return points
