# SPDX-License-Identifier: GPL-3.0-or-later
"""The GPU's way to interpolation.py's sums: a strand is made by sixteen neighbouring threads, the lanes of half a warp.

Lanes take neighbouring segments, so guides are read and strands written side by side; a sum over lanes makes points of
segments [Harris07]; and nothing is written twice. Warp has no word for what lanes pass to each other; CUDA has.
"""

import warp as wp

from .guide_weights import frame

wp.set_module_options({"enable_backward": False})

LANES = 16  # of a strand
ROUNDS = 3  # of lanes that are at work together: 41 points, with a seventh of the lanes idle
BLOCK_SIZE = 256

# Of l_i, below which |m_i| counts as this: where guides cancel, a direction is rounding and nothing else.
CANCELLED = wp.constant(1.0e-3)
LONGEST = wp.constant(1.0e18)  # [m]: of a segment whose square is still a float


@wp.func
def framed_offset(guide_points: wp.array2d[wp.vec3], guide: int, point: int, normal: wp.vec3):
    """Eq. 7's offset in the guide's frame, and how long it is; nothing at the root and past the tip."""
    tangent, bitangent = frame(normal)
    if point == 0 or point >= guide_points.shape[1]:
        return wp.vec4()
    offset = guide_points[guide, point] - guide_points[guide, point - 1]
    return wp.vec4(wp.dot(tangent, offset), wp.dot(bitangent, offset), wp.dot(normal, offset), wp.length(offset))


_SUMS = f"""
#if defined(__CUDA_ARCH__)
  const int lane = thread % {LANES};
  const unsigned everyone = 0xffffffffu;
  const int point_count = out_points.shape[1];
  const int slot_count = indices.shape[1];
  const int* guide = indices.data + size_t(strand) * slot_count;
  const float* weight = weights.data + size_t(strand) * slot_count;
  const float2* turn = reinterpret_cast<const float2*>(turns.data) + size_t(strand) * slot_count;
  const float4* guide_offsets = reinterpret_cast<const float4*>(offsets.data) + lane;
  float* row = reinterpret_cast<float*>(out_points.data) + size_t(strand) * point_count * 3;
  float along_x = 0.0f, along_y = 0.0f, along_z = 0.0f;
  for (int group = 0; group < point_count; group += {ROUNDS * LANES}) {{
    // A slot is read once for all rounds of a group.
    float x[{ROUNDS}] = {{}}, y[{ROUNDS}] = {{}}, z[{ROUNDS}] = {{}}, length[{ROUNDS}] = {{}};
    for (int slot = 0; slot < slot_count; ++slot) {{
      const float share = weight[slot];
      if (share > 0.0f) {{
        const float2 angle = turn[slot];
        const float cosine = share * angle.x;
        const float sine = share * angle.y;
        const float4* its_offsets = guide_offsets + guide[slot] * point_count + group;
        #pragma unroll
        for (int round = 0; round < {ROUNDS}; ++round) {{
          if (group + round * {LANES} + lane < point_count) {{
            const float4 offset = its_offsets[round * {LANES}];
            x[round] = fmaf(cosine, offset.x, fmaf(-sine, offset.y, x[round]));
            y[round] = fmaf(sine, offset.x, fmaf(cosine, offset.y, y[round]));
            z[round] = fmaf(share, offset.z, z[round]);
            length[round] = fmaf(share, offset.w, length[round]);
          }}
        }}
      }}
    }}
    #pragma unroll
    for (int round = 0; round < {ROUNDS}; ++round) {{
      const float a = x[round], b = y[round], c = z[round];
      const float found = fmaxf(sqrtf(a * a + b * b + c * c), fmaxf(cancelled * length[round], 1.0e-30f));
      const float stretch = found < longest ? 1.0f + keep_length * (length[round] / found - 1.0f) : 1.0f;
      float sum_x = stretch * (tangent[0] * a + bitangent[0] * b + normal[0] * c);
      float sum_y = stretch * (tangent[1] * a + bitangent[1] * b + normal[1] * c);
      float sum_z = stretch * (tangent[2] * a + bitangent[2] * b + normal[2] * c);
      #pragma unroll
      for (int step = 1; step < {LANES}; step *= 2) {{
        const float before_x = __shfl_up_sync(everyone, sum_x, step, {LANES});
        const float before_y = __shfl_up_sync(everyone, sum_y, step, {LANES});
        const float before_z = __shfl_up_sync(everyone, sum_z, step, {LANES});
        if (lane >= step) {{
          sum_x += before_x;
          sum_y += before_y;
          sum_z += before_z;
        }}
      }}
      sum_x += along_x;
      sum_y += along_y;
      sum_z += along_z;
      // Three numbers a lane, dealt out so that neighbouring lanes write neighbouring ones.
      const int first = group + round * {LANES};
      const int number_count = 3 * min({LANES}, point_count - first);
      #pragma unroll
      for (int part = 0; part < 3; ++part) {{
        const int number = part * {LANES} + lane;
        const int from = number / 3;
        const float its_x = __shfl_sync(everyone, sum_x, from, {LANES});
        const float its_y = __shfl_sync(everyone, sum_y, from, {LANES});
        const float its_z = __shfl_sync(everyone, sum_z, from, {LANES});
        const int axis = number - 3 * from;
        if (number < number_count) {{
          row[3 * first + number] = axis == 0 ? root[0] + its_x : axis == 1 ? root[1] + its_y : root[2] + its_z;
        }}
      }}
      along_x = __shfl_sync(everyone, sum_x, {LANES - 1}, {LANES});
      along_y = __shfl_sync(everyone, sum_y, {LANES - 1}, {LANES});
      along_z = __shfl_sync(everyone, sum_z, {LANES - 1}, {LANES});
    }}
  }}
#endif
"""


@wp.func_native(_SUMS)
def _sum_on_lanes(
    thread: int,
    strand: int,
    root: wp.vec3,
    tangent: wp.vec3,
    bitangent: wp.vec3,
    normal: wp.vec3,
    offsets: wp.array2d[wp.vec4],
    indices: wp.array2d[int],
    weights: wp.array2d[float],
    turns: wp.array2d[wp.vec2],
    cancelled: float,
    longest: float,
    keep_length: float,
    out_points: wp.array2d[wp.vec3],
): ...


@wp.kernel
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
    thread = wp.tid()
    # The last warp's lanes all have to be there: those of strands past the end make the last one again.
    strand = wp.min(thread / wp.static(LANES), roots.shape[0] - 1)
    normal = normals[strand]
    tangent, bitangent = frame(normal)
    _sum_on_lanes(
        thread,
        strand,
        roots[strand],
        tangent,
        bitangent,
        normal,
        offsets,
        indices,
        weights,
        turns,
        CANCELLED,
        LONGEST,
        keep_length,
        out_points,
    )


@wp.kernel
def _framed_offsets(
    guide_points: wp.array2d[wp.vec3],
    guide_normals: wp.array[wp.vec3],
    # outputs
    out_offsets: wp.array2d[wp.vec4],
):
    guide, point = wp.tid()
    out_offsets[guide, point] = framed_offset(guide_points, guide, point, guide_normals[guide])


def by_lanes(roots, normals, guide_points, guide_normals, guide_weights, keep_length=1.0, out=None):
    """What `interpolation.interpolate` returns; all arrays on one GPU."""
    device = roots.device
    offsets = wp.empty(guide_points.shape, dtype=wp.vec4, device=device)
    wp.launch(
        _framed_offsets,
        dim=offsets.shape,
        inputs=[guide_points, guide_normals],
        outputs=[offsets],
        device=device,
    )
    points = wp.empty((len(roots), guide_points.shape[1]), dtype=wp.vec3, device=device) if out is None else out
    strands_in_a_warp = 32 // LANES
    wp.launch(
        _strands_on_lanes,
        dim=-(-len(roots) // strands_in_a_warp) * 32,
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
