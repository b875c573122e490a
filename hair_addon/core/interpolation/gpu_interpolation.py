# SPDX-License-Identifier: GPL-3.0-or-later
"""GPU implementation of interpolation.py: eight neighbouring threads (lanes) compute a strand.

A lane makes five segments, so that one round makes the 41 points of most strands and a guide is read 128 bytes at a
time; sums over lanes make points of segments [Harris07]. A warp makes four strands at once, and four batches of these
one after the other: while one is summed up, what the next needs is brought into shared memory, and strands go from
there into memory as one run. Neighbours in memory should be neighbours on the surface: they read the same guides.
gpu_interpolation.cu is CUDA because Warp offers neither shuffles between lanes nor asynchronous copies.
"""

import warp as wp

from ..kernels import kernel_cache, native_code
from .guide_weights import GuideWeights, frame

LANES = 8  # of a strand
SEGMENTS = 5  # of a lane
ROUND = LANES * SEGMENTS  # segments
STRANDS = 32 // LANES  # of a warp at a time
BATCHES = 4  # of strands that a warp makes one after the other
BLOCK_SIZE = 128
BLOCKS = 8  # that a multiprocessor holds: 64 registers a thread, and all of a slot's offsets are read at once

# A module is compiled for a size of blocks: for this one, not for Warp's and then for this one.
wp.set_module_options({"enable_backward": False, "block_dim": BLOCK_SIZE})

# Of l_i, below which |m_i| counts as this: where guides cancel, a direction is rounding and nothing else.
CANCELLED = wp.constant(1.0e-3)
LONGEST = wp.constant(1.0e18)  # [m]: of a segment whose square is still a float


@wp.func
def framed_offset(guide_points: wp.array2d[wp.vec3], guide: int, point: int, normal: wp.vec3):
    """Eq. 7's offset to a point after the root, in the guide's frame, and how long it is; nothing past the tip."""
    tangent, bitangent = frame(normal)
    if point >= guide_points.shape[1]:
        return wp.vec4()
    offset = guide_points[guide, point] - guide_points[guide, point - 1]
    return wp.vec4(wp.dot(tangent, offset), wp.dot(bitangent, offset), wp.dot(normal, offset), wp.length(offset))


@wp.func_native(
    native_code.body(
        __file__,
        "gpu_interpolation.cu",
        LANES=LANES,
        SEGMENTS=SEGMENTS,
        ROUND=ROUND,
        STRANDS=STRANDS,
        BATCHES=BATCHES,
        BLOCK_SIZE=BLOCK_SIZE,
        STRETCH_LIMIT=1.0 / CANCELLED,
        SQUARE_LIMIT=LONGEST**2,
        LENGTH_LIMIT=LONGEST / CANCELLED,
    )
)
def _make_strands(
    thread: int,
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    offsets: wp.array2d[wp.vec4],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    keep_length: float,
    out_points: wp.array2d[wp.vec3],
): ...


@wp.kernel(grid_stride=False, launch_bounds=(BLOCK_SIZE, BLOCKS))
def _strands_on_lanes(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    offsets: wp.array2d[wp.vec4],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    keep_length: float,
    # outputs
    out_points: wp.array2d[wp.vec3],
):
    _make_strands(wp.tid(), roots, normals, offsets, indices, weights, turns, keep_length, out_points)


@wp.kernel
def _offsets_on_lanes(
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    # outputs
    out_offsets: wp.array2d[wp.vec4],
):
    """Those that lanes read at once side by side: first each lane's first one, then each lane's second."""
    guide, place = wp.tid()
    lane = place % wp.static(LANES)
    part = place / wp.static(LANES) % wp.static(SEGMENTS)
    segment = place / wp.static(ROUND) * wp.static(ROUND) + lane * wp.static(SEGMENTS) + part
    out_offsets[guide, place] = framed_offset(guide_points, guide, segment + 1, guide_normals[guide])


def by_lanes(
    roots: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    guide_weights: GuideWeights,
    keep_length: float = 1.0,
    out: wp.array2d[wp.vec3] | None = None,
) -> wp.array2d[wp.vec3]:
    """What `interpolation.interpolate` returns; all arrays on one GPU."""
    device = roots.device
    guide_count, point_count = guide_points.shape
    round_count = max(1, -(-(point_count - 1) // ROUND))
    offsets = wp.empty((guide_count, round_count * ROUND), dtype=wp.vec4, device=device)
    kernel_cache.launch(
        _offsets_on_lanes,
        dim=offsets.shape,
        inputs=[guide_points, guide_normals],
        outputs=[offsets],
        device=device,
        block_dim=BLOCK_SIZE,
    )
    points = wp.empty((len(roots), point_count), dtype=wp.vec3, device=device) if out is None else out
    kernel_cache.launch(
        _strands_on_lanes,
        dim=-(-len(roots) // (STRANDS * BATCHES)) * 32,
        inputs=[
            roots,
            normals,
            offsets,
            guide_weights.indices,
            guide_weights.weights,
            guide_weights.turns,
            keep_length,
        ],
        outputs=[points],
        device=device,
        block_dim=BLOCK_SIZE,
    )
    return points
