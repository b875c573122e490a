// SPDX-License-Identifier: GPL-3.0-or-later
//
// A strand as the weighted sum of its guides (interpolation.py), SEGMENTS of its segments at once: on a processor the
// lanes of a vector, on a GPU registers of a thread.
//
// The body of `_sum_guides` in interpolation.py. Parameters, for S strands of P points, K slots of guides a strand and
// G guides:
//
//   int strand                              the strand to make
//   vec3 root                               its root [m]
//   vec3 tangent, bitangent, normal         its frame
//   array_t<float> offsets                  (G, groups, 4 * SEGMENTS) segments of guides in the frames of their roots
//                                           [m]: of each group all x, then all y, all z, all lengths; 0 past the tip
//   array_t<int> indices                    (S, K) guides of each strand
//   array_t<float> weights                  (S, K) their weights, zero in unused slots
//   array_t<vec2> turns                     (S, K) cosine and sine of the turn from a guide's frame to the strand's
//   float keep_length                       0 to 1: how far segments are stretched to the guides' mean length
//   array_t<vec3> out_points                (S, P) [m]
//
// Constants:
//
//   SEGMENTS                                of a group: 8
//   WIDTH                                   the same
//   SLOT_LIMIT                              most guides of a strand

{
#include "lanes.h"
#include "vectors.h"
#include "guide_sum.strand"
constexpr int PARTS = SEGMENTS / LANES;
const int point_count = out_points.shape[1];
const int slot_count = indices.shape[1];
const int group_count = offsets.shape[1];

#if defined(__CUDA_ARCH__)
  const auto read_segments = [](lanes* to, const float* from) ALWAYS_INLINE {
    for (int k = 0; k < PARTS / 4; ++k) {
      const float4 four = __ldg(reinterpret_cast<const float4*>(from) + k);
      to[4 * k] = four.x;
      to[4 * k + 1] = four.y;
      to[4 * k + 2] = four.z;
      to[4 * k + 3] = four.w;
    }
  };
  // From segments to points: sums of all segments from `last` on, which becomes the last of them.
  const auto add_up = [](lanes* along, float& last) ALWAYS_INLINE {
    for (int part = 0; part < PARTS; ++part) along[part] = last += along[part];
  };
  const auto write_points = [](const lanes* x, const lanes* y, const lanes* z, float* to, int count) ALWAYS_INLINE {
#pragma unroll
    for (int part = 0; part < PARTS; ++part) {
      if (part < count) {
        to[3 * part] = x[part];
        to[3 * part + 1] = y[part];
        to[3 * part + 2] = z[part];
      }
    }
  };
#else
  const auto read_segments = [](lanes* to, const float* from) ALWAYS_INLINE {
    __builtin_memcpy(to, from, sizeof(lanes));
  };
  // The same by an inclusive scan over the lanes [Harris07]: vectors are moved up by some lanes, with zeros below.
  const auto add_up = [](lanes* along, float& last) ALWAYS_INLINE {
    const lanes zeros = 0.0f;
    const auto up_by_1 = [&](lanes v) { return __builtin_shufflevector(zeros, v, 0, 8, 9, 10, 11, 12, 13, 14); };
    const auto up_by_2 = [&](lanes v) { return __builtin_shufflevector(zeros, v, 0, 0, 8, 9, 10, 11, 12, 13); };
    const auto up_by_4 = [&](lanes v) { return __builtin_shufflevector(zeros, v, 0, 0, 0, 0, 8, 9, 10, 11); };
    along[0] += up_by_1(along[0]);
    along[0] += up_by_2(along[0]);
    along[0] += up_by_4(along[0]) + last;
    last = along[0][LANES - 1];
  };
  // From three vectors to points as they lie in memory: x0 y0 z0 x1 y1 z1 …
  const auto write_points = [](const lanes* x, const lanes* y, const lanes* z, float* to, int count) ALWAYS_INLINE {
    const lanes xy_0 = __builtin_shufflevector(x[0], y[0], 0, 8, 0, 1, 9, 0, 2, 10);
    const lanes xy_1 = __builtin_shufflevector(x[0], y[0], 0, 3, 11, 0, 4, 12, 0, 5);
    const lanes xy_2 = __builtin_shufflevector(x[0], y[0], 13, 0, 6, 14, 0, 7, 15, 0);
    const lanes part_0 = __builtin_shufflevector(xy_0, z[0], 0, 1, 8, 3, 4, 9, 6, 7);
    const lanes part_1 = __builtin_shufflevector(xy_1, z[0], 10, 1, 2, 11, 4, 5, 12, 7);
    const lanes part_2 = __builtin_shufflevector(xy_2, z[0], 0, 13, 2, 3, 14, 5, 6, 15);
    if (count >= LANES) {
      __builtin_memcpy(to, &part_0, sizeof(lanes));
      __builtin_memcpy(to + LANES, &part_1, sizeof(lanes));
      __builtin_memcpy(to + 2 * LANES, &part_2, sizeof(lanes));
    } else {
      // The last group may be longer than the rest of the strand.
      const lanes parts[3] = {part_0, part_1, part_2};
      const float* numbers = reinterpret_cast<const float*>(parts);
      for (int number = 0; number < 3 * count; ++number) to[number] = numbers[number];
    }
  };
#endif

// The guides with a weight: where their offsets begin, and the factors of those.
const float* guide[SLOT_LIMIT];
float share[SLOT_LIMIT], cosine[SLOT_LIMIT], sine[SLOT_LIMIT];
int guide_count = 0;
for (int slot = 0; slot < slot_count; ++slot) {
  const size_t place = size_t(strand) * slot_count + slot;
  const float weight = weights.data[place];
  if (weight > 0.0f) {
    guide[guide_count] = offsets.data + size_t(indices.data[place]) * group_count * (4 * SEGMENTS);
    share[guide_count] = weight;
    cosine[guide_count] = weight * turns.data[place][0];
    sine[guide_count] = weight * turns.data[place][1];
    ++guide_count;
  }
}

float* row = reinterpret_cast<float*>(out_points.data) + size_t(strand) * point_count * 3;
float last_x = root[0], last_y = root[1], last_z = root[2];
row[0] = last_x;
row[1] = last_y;
row[2] = last_z;
for (int group = 0; group < group_count; ++group) {
  lanes x[PARTS] = {}, y[PARTS] = {}, z[PARTS] = {}, size[PARTS] = {};
  for (int g = 0; g < guide_count; ++g) {
    const float* its_offsets = guide[g] + group * (4 * SEGMENTS);
    lanes guide_x[PARTS], guide_y[PARTS], guide_z[PARTS], guide_size[PARTS];
    read_segments(guide_x, its_offsets);
    read_segments(guide_y, its_offsets + SEGMENTS);
    read_segments(guide_z, its_offsets + 2 * SEGMENTS);
    read_segments(guide_size, its_offsets + 3 * SEGMENTS);
#pragma unroll
    for (int k = 0; k < PARTS; ++k) {
      add_guide(
          x[k], y[k], z[k], size[k], share[g], cosine[g], sine[g], guide_x[k], guide_y[k], guide_z[k], guide_size[k]);
    }
  }
  // Out of the strand's frame.
#pragma unroll
  for (int k = 0; k < PARTS; ++k) {
    const lanes stretch = stretch_of(x[k], y[k], z[k], size[k], keep_length);
    const lanes along_x = stretch * (tangent[0] * x[k] + bitangent[0] * y[k] + normal[0] * z[k]);
    const lanes along_y = stretch * (tangent[1] * x[k] + bitangent[1] * y[k] + normal[1] * z[k]);
    const lanes along_z = stretch * (tangent[2] * x[k] + bitangent[2] * y[k] + normal[2] * z[k]);
    x[k] = along_x;
    y[k] = along_y;
    z[k] = along_z;
  }
  add_up(x, last_x);
  add_up(y, last_y);
  add_up(z, last_z);
  write_points(x, y, z, row + 3 + group * (3 * SEGMENTS), point_count - 1 - group * SEGMENTS);
}
}
