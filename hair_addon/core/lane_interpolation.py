# SPDX-License-Identifier: GPL-3.0-or-later
"""The GPU's way to interpolation.py's sums: a strand is made by eight neighbouring threads, its lanes.

A lane makes five segments, so that one round makes the 41 points of most strands and a guide is read 128 bytes at a
time; sums over lanes make points of segments [Harris07]. A warp makes four strands at once, and four batches of these
one after the other: while one is summed up, what the next needs is brought into shared memory, and strands go from
there into memory as one run. Neighbours in memory should be neighbours on the surface: they read the same guides.
Warp has no word for what lanes pass to each other, nor for copies that wait for nothing; CUDA has.
"""

import warp as wp

from .guide_weights import frame

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


_STRANDS = f"""
#if defined(__CUDA_ARCH__)
  struct Needs {{
    float2 turns[32];
    float shares[32];
    int guides[32];
    float places[{STRANDS}][8];  // root, normal
  }};
  struct Room {{
    float points[{STRANDS * 3 * (ROUND + 1)}];
    Needs needs[2];
  }};
  __shared__ __align__(16) Room rooms[{BLOCK_SIZE // 32}];
  const unsigned everyone = 0xffffffffu;
  const int slot_count = indices.shape[1];
  const int round_count = max(1, (out_points.shape[1] + {ROUND - 2}) / {ROUND});
  int first = thread / 32 * {STRANDS * BATCHES};
  const int end = min(first + {STRANDS * BATCHES}, out_points.shape[0]);

  // From memory to shared memory, past the registers where the GPU can: `copy` does not wait, `wait` does.
  auto copy = [](auto* to, const auto* from) {{
    #if __CUDA_ARCH__ >= 800
      const unsigned place = static_cast<unsigned>(__cvta_generic_to_shared(to));
      asm volatile("cp.async.ca.shared.global [%0], [%1], %2;" :: "r"(place), "l"(from), "n"(sizeof(*to)) : "memory");
    #else
      *to = *from;
    #endif
  }};
  auto wait = [] {{
    #if __CUDA_ARCH__ >= 800
      asm volatile("cp.async.wait_all;" ::: "memory");
    #endif
    __syncwarp();
  }};
  // A lane brings a slot. The last strands' lanes all have to be there: those past the end make the last strand again.
  auto bring_slots = [&](Needs& needs, int strands, int slots) {{
    const int self = threadIdx.x % 32;
    const int slot = slots + self % {LANES};
    if (slot < slot_count) {{
      const size_t place = size_t(min(strands + self / {LANES}, end - 1)) * slot_count + slot;
      copy(needs.shares + self, weights.data + place);
      copy(needs.guides + self, indices.data + place);
      copy(needs.turns + self, reinterpret_cast<const float2*>(turns.data) + place);
    }} else {{
      needs.shares[self] = 0.0f;
    }}
  }};
  auto bring = [&](Needs& needs, int strands) {{
    bring_slots(needs, strands, 0);
    const int team = threadIdx.x % 32 / {LANES};
    const int number = threadIdx.x % {LANES};
    const int strand = min(strands + team, end - 1);
    const float* place = reinterpret_cast<const float*>((number < 3 ? roots.data : normals.data) + strand);
    if (number < 6) copy(needs.places[team] + number, place + number % 3);
  }};

  if (first < end) bring(rooms[threadIdx.x / 32].needs[0], first);
  for (int batch = 0; first < end; first += {STRANDS}, ++batch) {{
    wait();
    Needs& needs = rooms[threadIdx.x / 32].needs[batch % 2];
    if (first + {STRANDS} < end) bring(rooms[threadIdx.x / 32].needs[(batch + 1) % 2], first + {STRANDS});
    for (int round = 0; round < round_count; ++round) {{
      float x[{SEGMENTS}] = {{}}, y[{SEGMENTS}] = {{}}, z[{SEGMENTS}] = {{}}, length[{SEGMENTS}] = {{}};
      for (int slots = 0; slots < slot_count; slots += {LANES}) {{
        if (slot_count > {LANES} && round + slots > 0) {{
          __syncwarp();
          bring_slots(needs, first, slots);
          wait();
        }}
        const int own = threadIdx.x % 32 / {LANES} * {LANES};
        #pragma unroll 1
        for (int slot = own; slot < own + {LANES}; ++slot) {{
          const float share = needs.shares[slot];
          if (share > 0.0f) {{
            const float4* its_offsets = reinterpret_cast<const float4*>(offsets.data)
              + (needs.guides[slot] * round_count + round) * {ROUND} + threadIdx.x % {LANES};
            const float cosine = share * needs.turns[slot].x;
            const float sine = share * needs.turns[slot].y;
            #pragma unroll
            for (int part = 0; part < {SEGMENTS}; ++part) {{
              const float4 offset = __ldg(its_offsets + part * {LANES});
              x[part] = fmaf(cosine, offset.x, fmaf(-sine, offset.y, x[part]));
              y[part] = fmaf(sine, offset.x, fmaf(cosine, offset.y, y[part]));
              z[part] = fmaf(share, offset.z, z[part]);
              length[part] = fmaf(share, offset.w, length[part]);
            }}
          }}
        }}
      }}
      __syncwarp();
      // What follows is not worked out beforehand: sums need the registers.
      int self = threadIdx.x;
      int point_count = out_points.shape[1];
      asm volatile("" : "+r"(self), "+r"(point_count));
      const int lane = self % {LANES};
      const int team = self % 32 / {LANES};
      float* place = needs.places[team];
      // As in guide_weights.py.
      const float normal_x = place[3], normal_y = place[4], normal_z = place[5];
      const float sign = normal_z >= 0.0f ? 1.0f : -1.0f;
      const float a = __fdividef(-1.0f, sign + normal_z);
      const float b = normal_x * normal_y * a;
      const float tangent_x = 1.0f + sign * normal_x * normal_x * a, tangent_y = sign * b, tangent_z = -sign * normal_x;
      const float bitangent_x = b, bitangent_y = sign + normal_y * normal_y * a, bitangent_z = -normal_y;
      float sum_x = 0.0f, sum_y = 0.0f, sum_z = 0.0f;
      #pragma unroll
      for (int part = 0; part < {SEGMENTS}; ++part) {{
        const float square = x[part] * x[part] + y[part] * y[part] + z[part] * z[part];
        const float wanted = fminf(length[part] * rsqrtf(square), {1.0 / CANCELLED}f);
        const bool is_float = square < {LONGEST**2}f && length[part] < {LONGEST / CANCELLED}f;
        const float stretch = is_float ? fmaf(keep_length, wanted - 1.0f, 1.0f) : 1.0f;
        const float along_x = tangent_x * x[part] + bitangent_x * y[part] + normal_x * z[part];
        const float along_y = tangent_y * x[part] + bitangent_y * y[part] + normal_y * z[part];
        const float along_z = tangent_z * x[part] + bitangent_z * y[part] + normal_z * z[part];
        x[part] = sum_x = fmaf(stretch, along_x, sum_x);
        y[part] = sum_y = fmaf(stretch, along_y, sum_y);
        z[part] = sum_z = fmaf(stretch, along_z, sum_z);
      }}
      // From each lane's own sums to those of the lanes before it.
      sum_x = __shfl_up_sync(everyone, sum_x, 1, {LANES});
      sum_y = __shfl_up_sync(everyone, sum_y, 1, {LANES});
      sum_z = __shfl_up_sync(everyone, sum_z, 1, {LANES});
      if (lane == 0) sum_x = sum_y = sum_z = 0.0f;
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
      #if __CUDA_ARCH__ >= 900
        if (self % 32 == 0) asm volatile("cp.async.bulk.wait_group.read 0;" ::: "memory");
        __syncwarp();
      #endif
      // Strands that one round makes lie in shared memory as they will in memory, others by rounds.
      const bool is_whole = point_count <= {ROUND + 1};
      float* points = rooms[self / 32].points;
      float* row = points + team * 3 * (is_whole ? point_count : {ROUND + 1});
      const float from_x = place[0], from_y = place[1], from_z = place[2];
      if (lane == 0) {{
        row[0] = from_x;
        row[1] = from_y;
        row[2] = from_z;
      }}
      sum_x += from_x;
      sum_y += from_y;
      sum_z += from_z;
      const int before = lane * {SEGMENTS};
      #pragma unroll
      for (int part = 0; part < {SEGMENTS}; ++part) {{
        x[part] += sum_x;
        y[part] += sum_y;
        z[part] += sum_z;
        if (round * {ROUND} + before + part + 1 < point_count) {{
          row[3 * (before + part + 1)] = x[part];
          row[3 * (before + part + 1) + 1] = y[part];
          row[3 * (before + part + 1) + 2] = z[part];
        }}
      }}
      const int strand_count = min({STRANDS}, end - first);
      float* to = reinterpret_cast<float*>(out_points.data) + size_t(first) * point_count * 3;
      if (is_whole) {{
        const int number_count = strand_count * point_count * 3;
        #if __CUDA_ARCH__ >= 900
          if (number_count % 4 == 0 && reinterpret_cast<size_t>(to) % 16 == 0) {{
            // One copy that nobody waits for: the strands made next need the room, and so does the block's end.
            asm volatile("fence.proxy.async.shared::cta;" ::: "memory");
            __syncwarp();
            if (self % 32 == 0) {{
              const unsigned from = static_cast<unsigned>(__cvta_generic_to_shared(points));
              asm volatile("cp.async.bulk.global.shared::cta.bulk_group [%0], [%1], %2;"
                :: "l"(to), "r"(from), "r"(4 * number_count) : "memory");
              asm volatile("cp.async.bulk.commit_group;" ::: "memory");
            }}
            continue;
          }}
        #endif
        __syncwarp();
        for (int number = self % 32; number < number_count; number += 32) to[number] = points[number];
      }} else {{
        __syncwarp();
        // The next round starts where this one ends.
        if (lane == {LANES - 1}) {{
          place[0] = x[{SEGMENTS - 1}];
          place[1] = y[{SEGMENTS - 1}];
          place[2] = z[{SEGMENTS - 1}];
        }}
        const int begin = round == 0 ? 0 : 3;
        const int number_count = 3 * min({ROUND + 1}, point_count - round * {ROUND});
        for (int strand = 0; strand < strand_count; ++strand) {{
          float* its = to + (size_t(strand) * point_count + round * {ROUND}) * 3;
          for (int number = begin + self % 32; number < number_count; number += 32) {{
            its[number] = points[strand * {3 * (ROUND + 1)} + number];
          }}
        }}
      }}
      __syncwarp();
    }}
  }}
  #if __CUDA_ARCH__ >= 900
    asm volatile("cp.async.bulk.wait_group.read 0;" ::: "memory");
  #endif
#endif
"""


@wp.func_native(_STRANDS)
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


def by_lanes(roots, normals, guide_points, guide_normals, guide_weights, keep_length=1.0, out=None):
    """What `interpolation.interpolate` returns; all arrays on one GPU."""
    device = roots.device
    guide_count, point_count = guide_points.shape
    round_count = max(1, -(-(point_count - 1) // ROUND))
    offsets = wp.empty((guide_count, round_count * ROUND), dtype=wp.vec4, device=device)
    wp.launch(
        _offsets_on_lanes,
        dim=offsets.shape,
        inputs=[guide_points, guide_normals],
        outputs=[offsets],
        device=device,
        block_dim=BLOCK_SIZE,
    )
    points = wp.empty((len(roots), point_count), dtype=wp.vec3, device=device) if out is None else out
    wp.launch(
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
