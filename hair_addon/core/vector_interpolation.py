# SPDX-License-Identifier: GPL-3.0-or-later
"""The processor's way to interpolation.py's sums: eight segments of a strand at once, in its vector registers.

Written in Clang's vectors, which Warp compiles for whatever processor it is on: AVX, NEON. The sums stay in registers
over all guides, points of segments are made by a sum over lanes [Harris07], and a strand is written once.
"""

import warp as wp

from . import cores
from .cores import Rows
from .guide_weights import frame
from .hash_grid import LIMIT
from .lane_interpolation import CANCELLED, LONGEST, framed_offset

wp.set_module_options({"enable_backward": False})

LANES = 8

_SUMS = f"""
#if !defined(__CUDA_ARCH__)
  {{
  // Products are added in one step where the processor can, as on a GPU: a tenth of the time.
  #pragma clang fp contract(fast)
  typedef float lanes __attribute__((ext_vector_type({LANES})));
  const int point_count = out_points.shape[1];
  const int slot_count = indices.shape[1];
  const int group_count = offsets.shape[1];
  // Of the guides with a share: where their offsets are, and what these are multiplied by.
  const float* guide[{LIMIT}];
  float share[{LIMIT}], cosine[{LIMIT}], sine[{LIMIT}];
  int guide_count = 0;
  for (int slot = 0; slot < slot_count; ++slot) {{
    const size_t place = size_t(strand) * slot_count + slot;
    const float weight = weights.data[place];
    if (weight > 0.0f) {{
      guide[guide_count] = offsets.data + size_t(indices.data[place]) * group_count * {4 * LANES};
      share[guide_count] = weight;
      cosine[guide_count] = weight * turns.data[place][0];
      sine[guide_count] = weight * turns.data[place][1];
      ++guide_count;
    }}
  }}
  float* row = reinterpret_cast<float*>(out_points.data) + size_t(strand) * point_count * 3;
  float last_x = root[0], last_y = root[1], last_z = root[2];
  row[0] = last_x;
  row[1] = last_y;
  row[2] = last_z;
  for (int group = 0; group < group_count; ++group) {{
    lanes x = 0.0f, y = 0.0f, z = 0.0f, length = 0.0f;
    for (int g = 0; g < guide_count; ++g) {{
      lanes offset_x, offset_y, offset_z, offset_length;
      const float* its_offsets = guide[g] + group * {4 * LANES};
      __builtin_memcpy(&offset_x, its_offsets, sizeof(lanes));
      __builtin_memcpy(&offset_y, its_offsets + {LANES}, sizeof(lanes));
      __builtin_memcpy(&offset_z, its_offsets + {2 * LANES}, sizeof(lanes));
      __builtin_memcpy(&offset_length, its_offsets + {3 * LANES}, sizeof(lanes));
      x += cosine[g] * offset_x - sine[g] * offset_y;
      y += sine[g] * offset_x + cosine[g] * offset_y;
      z += share[g] * offset_z;
      length += share[g] * offset_length;
    }}
    const lanes least = __builtin_elementwise_max(cancelled * length, lanes(1.0e-30f));
    const lanes found = __builtin_elementwise_max(__builtin_elementwise_sqrt(x * x + y * y + z * z), least);
    lanes stretch = 1.0f + keep_length * (length / found - 1.0f);
    stretch = found < longest ? stretch : lanes(1.0f);
    // Out of the strand's frame, and each lane with what is in the lanes before it.
    lanes along_x = stretch * (tangent[0] * x + bitangent[0] * y + normal[0] * z);
    lanes along_y = stretch * (tangent[1] * x + bitangent[1] * y + normal[1] * z);
    lanes along_z = stretch * (tangent[2] * x + bitangent[2] * y + normal[2] * z);
    const lanes none = 0.0f;
    #define BEFORE_1(v) __builtin_shufflevector(none, v, 0, 8, 9, 10, 11, 12, 13, 14)
    #define BEFORE_2(v) __builtin_shufflevector(none, v, 0, 0, 8, 9, 10, 11, 12, 13)
    #define BEFORE_4(v) __builtin_shufflevector(none, v, 0, 0, 0, 0, 8, 9, 10, 11)
    along_x += BEFORE_1(along_x);
    along_y += BEFORE_1(along_y);
    along_z += BEFORE_1(along_z);
    along_x += BEFORE_2(along_x);
    along_y += BEFORE_2(along_y);
    along_z += BEFORE_2(along_z);
    along_x += BEFORE_4(along_x) + last_x;
    along_y += BEFORE_4(along_y) + last_y;
    along_z += BEFORE_4(along_z) + last_z;
    last_x = along_x[{LANES - 1}];
    last_y = along_y[{LANES - 1}];
    last_z = along_z[{LANES - 1}];
    // Three numbers a point, side by side.
    const lanes xy_0 = __builtin_shufflevector(along_x, along_y, 0, 8, 0, 1, 9, 0, 2, 10);
    const lanes xy_1 = __builtin_shufflevector(along_x, along_y, 0, 3, 11, 0, 4, 12, 0, 5);
    const lanes xy_2 = __builtin_shufflevector(along_x, along_y, 13, 0, 6, 14, 0, 7, 15, 0);
    const lanes part_0 = __builtin_shufflevector(xy_0, along_z, 0, 1, 8, 3, 4, 9, 6, 7);
    const lanes part_1 = __builtin_shufflevector(xy_1, along_z, 10, 1, 2, 11, 4, 5, 12, 7);
    const lanes part_2 = __builtin_shufflevector(xy_2, along_z, 0, 13, 2, 3, 14, 5, 6, 15);
    float* to = row + 3 + group * {3 * LANES};
    if (1 + (group + 1) * {LANES} <= point_count) {{
      __builtin_memcpy(to, &part_0, sizeof(lanes));
      __builtin_memcpy(to + {LANES}, &part_1, sizeof(lanes));
      __builtin_memcpy(to + {2 * LANES}, &part_2, sizeof(lanes));
    }} else {{
      float whole[{3 * LANES}];
      __builtin_memcpy(whole, &part_0, sizeof(lanes));
      __builtin_memcpy(whole + {LANES}, &part_1, sizeof(lanes));
      __builtin_memcpy(whole + {2 * LANES}, &part_2, sizeof(lanes));
      for (int number = 0; number < 3 * (point_count - 1 - group * {LANES}); ++number) to[number] = whole[number];
    }}
  }}
  }}
#endif
"""


@wp.func_native(_SUMS)
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
    cancelled: float,
    longest: float,
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
        CANCELLED,
        LONGEST,
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


def by_vectors(roots, normals, guide_points, guide_normals, guide_weights, keep_length=1.0, out=None):
    """What `interpolation.interpolate` returns; all arrays on the processor."""
    guide_count, point_count = guide_points.shape
    group_count = -(-(point_count - 1) // LANES)
    offsets = wp.empty((guide_count, group_count, 4 * LANES), dtype=float, device=roots.device)
    cores.launch(
        _offsets_in_vectors,
        guide_count,
        inputs=[Rows(guide_points), Rows(guide_normals)],
        outputs=[offsets],
        device=roots.device,
        least_rows=256,
    )
    points = cores.empty_vectors((len(roots), point_count), roots.device) if out is None else out
    cores.launch(
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
