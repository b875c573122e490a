// SPDX-License-Identifier: GPL-3.0-or-later
//
// A strand as the weighted sum of its guides (interpolation.py), SEGMENTS segments at once: in the lanes of a vector on
// a CPU, in neighboring threads on a GPU.
//
// The body of `_sum_guides` in interpolation.py. Parameters, for S strands of P points, K slots of guides per strand
// and G guides:
//
//   int strand, int out_row                 index of the strand, and of the row of its weights and results
//   vec3 root                               its root [m]
//   vec3 tangent, bitangent, normal         its frame
//   array_t<vec3> guide_points              (G, P) [m]
//   array_t<float> guide_rows               (G, 8) normal and position of each guide's root, its length, and 1 / its
//                                           number of points up to its tie, 0 for guides that are not gathered
//   array_t<float> offsets                  (G, groups, 4 * SEGMENTS) segments of guides in the frames of their roots
//                                           [m], 0 past the tip. In each group: on a CPU all x, all y, all z, then all
//                                           lengths; on a GPU x, y, z and length of each segment
//   array_t<int> indices                    (S, K) guides of each strand
//   array_t<float> weights                  (R, K) their weights, zero in unused slots
//   array_t<vec2> turns                     (S, K) cosine and sine of the angle from a guide's frame to the strand's
//   float spread                            limit of a strand's turn against its guides (interpolation.py)
//   float keep_length                       0 to 1: blend to segments with the guides' mean length
//   array_t<vec3> out_points                (R, P) [m]
//
// Constants:
//
//   SEGMENTS                                of a group: 8
//   WIDTH                                   the same
//   SLOT_LIMIT                              maximum number of guides per strand

{
#include "lanes.h"
#include "vectors.h"
#include "guide_rows.h"
#include "guide_points.h"
#include "guide_sum.strand"
const int point_count = out_points.shape[1];
const int slot_count = indices.shape[1];
const int group_count = offsets.shape[1];

// A guide of the strand: its index, its offsets, its weight, and the cosine and sine of its rotation times the weight.
struct Guide {
  int index;
  const float* offsets;
  float share, cosine, sine;
};
// A group of its segments.
struct Segments {
  lanes x, y, z, size;
};
const auto guide_of = [&](int slot) ALWAYS_INLINE {
  const size_t place = size_t(strand) * slot_count + slot, share_place = size_t(out_row) * slot_count + slot;
  Guide guide;
  guide.share = weights.data[share_place];
  guide.index = indices.data[place];
  guide.offsets = offsets.data + size_t(guide.index) * group_count * (4 * SEGMENTS);
  guide.cosine = guide.share * turns.data[place][0];
  guide.sine = guide.share * turns.data[place][1];
  return guide;
};

#if defined(__CUDA_ARCH__)
  const auto sum_of = [](lanes value) { return value; };
  const int lane = threadIdx.x % SEGMENTS;
  // The threads of this strand, as bits of the warp.
  const unsigned team = ((1u << SEGMENTS) - 1u) << (threadIdx.x % 32 / SEGMENTS * SEGMENTS);
  const auto read_segments = [&](const float* from) {
    const float4 found = __ldg(reinterpret_cast<const float4*>(from) + lane);
    return Segments{found.x, found.y, found.z, found.w};
  };
  // From segments to points: running sums that start at `last`, which becomes the last sum.
  const auto add_up = [&](lanes& along, float& last) {
    for (int step = 1; step < SEGMENTS; step *= 2) {
      const float before = __shfl_up_sync(team, along, step, SEGMENTS);
      along += lane >= step ? before : 0.0f;
    }
    along += last;
    last = __shfl_sync(team, along, SEGMENTS - 1, SEGMENTS);
  };
  const auto write_points = [&](lanes x, lanes y, lanes z, float* to, int count) {
    if (lane < count) {
      to[3 * lane] = x;
      to[3 * lane + 1] = y;
      to[3 * lane + 2] = z;
    }
  };
  // Slots are read for each group: registers with a dynamic index would be memory.
  const auto for_guides = [&](auto use) {
    for (int slot = 0; slot < slot_count; ++slot) {
      if (weights.data[size_t(out_row) * slot_count + slot] > 0.0f) use(guide_of(slot));
    }
  };
#else
  // The sum of all lanes, in each lane.
  const auto sum_of = [](lanes v) ALWAYS_INLINE {
    v += __builtin_shufflevector(v, v, 4, 5, 6, 7, 0, 1, 2, 3);
    v += __builtin_shufflevector(v, v, 2, 3, 0, 1, 6, 7, 4, 5);
    return v + __builtin_shufflevector(v, v, 1, 0, 3, 2, 5, 4, 7, 6);
  };
  const auto read_segments = [](const float* from) ALWAYS_INLINE {
    Segments found;
    __builtin_memcpy(&found, from, sizeof(Segments));
    return found;
  };
  // The same by an inclusive scan over the lanes [Harris07]: vectors are shifted up, with zeros below.
  const auto add_up = [](lanes& along, float& last) ALWAYS_INLINE {
    const lanes zeros = 0.0f;
    const auto up_by_1 = [&](lanes v) { return __builtin_shufflevector(zeros, v, 0, 8, 9, 10, 11, 12, 13, 14); };
    const auto up_by_2 = [&](lanes v) { return __builtin_shufflevector(zeros, v, 0, 0, 8, 9, 10, 11, 12, 13); };
    const auto up_by_4 = [&](lanes v) { return __builtin_shufflevector(zeros, v, 0, 0, 0, 0, 8, 9, 10, 11); };
    along += up_by_1(along);
    along += up_by_2(along);
    along += up_by_4(along) + last;
    last = along[LANES - 1];
  };
  // From three vectors to points in memory order: x0 y0 z0 x1 y1 z1 …
  const auto write_points = [](lanes x, lanes y, lanes z, float* to, int count) ALWAYS_INLINE {
    const lanes xy_0 = __builtin_shufflevector(x, y, 0, 8, 0, 1, 9, 0, 2, 10);
    const lanes xy_1 = __builtin_shufflevector(x, y, 0, 3, 11, 0, 4, 12, 0, 5);
    const lanes xy_2 = __builtin_shufflevector(x, y, 13, 0, 6, 14, 0, 7, 15, 0);
    const lanes part_0 = __builtin_shufflevector(xy_0, z, 0, 1, 8, 3, 4, 9, 6, 7);
    const lanes part_1 = __builtin_shufflevector(xy_1, z, 10, 1, 2, 11, 4, 5, 12, 7);
    const lanes part_2 = __builtin_shufflevector(xy_2, z, 0, 13, 2, 3, 14, 5, 6, 15);
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
  Guide guides[SLOT_LIMIT];
  int guide_count = 0;
  for (int slot = 0; slot < slot_count; ++slot) {
    if (weights.data[size_t(out_row) * slot_count + slot] > 0.0f) guides[guide_count++] = guide_of(slot);
  }
  const auto for_guides = [&](auto use) ALWAYS_INLINE {
    for (int number = 0; number < guide_count; ++number) use(guides[number]);
  };
#endif

// The frame, which turns at most by the spread against the guides.
lanes mean_x = 0.0f, mean_y = 0.0f, mean_z = 0.0f, mean_length = 0.0f, mean_way = 0.0f, tied = 0.0f;
for (int first = 0; first < slot_count; first += LANES) {
  const int count = slot_count - first < LANES ? slot_count - first : LANES;
  ints its_guides = -1;
  lanes share = 0.0f;
  read_lanes(its_guides, indices.data + size_t(strand) * slot_count + first, count);
  read_lanes(share, weights.data + size_t(out_row) * slot_count + first, count);
  lanes its[8];
  read_columns(its, its_guides, guide_rows.data);
  const auto weighed = [&](lanes value) { return share > 0.0f ? share * value : lanes(0.0f); };
  const vector way = {its[3] - root[0], its[4] - root[1], its[5] - root[2]};
  mean_x += weighed(its[0]);
  mean_y += weighed(its[1]);
  mean_z += weighed(its[2]);
  mean_length += weighed(its[6]);
  mean_way += weighed(sqrt_of(dot(way, way)));
  tied += weighed(its[7]);
}
const bool is_tied = get_lane(sum_of(tied), 0) > 0.0f;
const vector own = {normal[0], normal[1], normal[2]};
const vector limited = limited_normal(
    own, {sum_of(mean_x), sum_of(mean_y), sum_of(mean_z)}, spread * sum_of(mean_way) / sum_of(mean_length));
auto along_tangent = tangent;
auto along_bitangent = bitangent;
auto along_normal = normal;
const auto put = [&](auto& to, const vector& from) {
  to[0] = get_lane(from.x, 0);
  to[1] = get_lane(from.y, 0);
  to[2] = get_lane(from.z, 0);
};
put(along_normal, limited);
if (along_normal[0] != normal[0] || along_normal[1] != normal[1] || along_normal[2] != normal[2]) {
  put(along_tangent, carried_along({tangent[0], tangent[1], tangent[2]}, own, limited));
  put(along_bitangent, carried_along({bitangent[0], bitangent[1], bitangent[2]}, own, limited));
}

float* row = reinterpret_cast<float*>(out_points.data) + size_t(out_row) * point_count * 3;
float last_x = root[0], last_y = root[1], last_z = root[2];
row[0] = last_x;
row[1] = last_y;
row[2] = last_z;
for (int group = 0; group < group_count; ++group) {
  lanes x = 0.0f, y = 0.0f, z = 0.0f, size = 0.0f;
  for_guides([&](const Guide& guide) ALWAYS_INLINE {
    const Segments its = read_segments(guide.offsets + group * (4 * SEGMENTS));
    add_guide(x, y, z, size, guide.share, guide.cosine, guide.sine, its.x, its.y, its.z, its.size);
  });
  // Out of the strand's frame.
  const lanes stretch = stretch_of(x, y, z, size, keep_length);
  lanes along_x = stretch * (along_tangent[0] * x + along_bitangent[0] * y + along_normal[0] * z);
  lanes along_y = stretch * (along_tangent[1] * x + along_bitangent[1] * y + along_normal[1] * z);
  lanes along_z = stretch * (along_tangent[2] * x + along_bitangent[2] * y + along_normal[2] * z);
  add_up(along_x, last_x);
  add_up(along_y, last_y);
  add_up(along_z, last_z);
  if (is_tied) {
#if defined(__CUDA_ARCH__)
    const int first = 1 + SEGMENTS * group + lane;
    const lanes point = to_lanes(first);
#else
    const int first = 1 + SEGMENTS * group;
    const lanes point = to_lanes(first + ints{0, 1, 2, 3, 4, 5, 6, 7});
#endif
    lanes part = 0.0f, middle_x = 0.0f, middle_y = 0.0f, middle_z = 0.0f;
    for_guides([&](const Guide& guide) {
      const float* its = reinterpret_cast<const float*>(guide_points.data) + size_t(guide.index) * point_count * 3;
      lanes its_x, its_y, its_z;
      read_points(its, first, point_count, its_x, its_y, its_z);
      part += guide.share * tied_part(point, guide_rows.data[size_t(guide.index) * 8 + 7]);
      middle_x += guide.share * its_x;
      middle_y += guide.share * its_y;
      middle_z += guide.share * its_z;
    });
    along_x += part * (middle_x - along_x);
    along_y += part * (middle_y - along_y);
    along_z += part * (middle_z - along_z);
  }
  write_points(along_x, along_y, along_z, row + 3 + group * (3 * SEGMENTS), point_count - 1 - group * SEGMENTS);
}
}
