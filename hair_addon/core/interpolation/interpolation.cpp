// SPDX-License-Identifier: GPL-3.0-or-later
//
// A strand as the weighted sum of its guides (interpolation.py), LANES segments at once in Clang's vectors.
//
// The body of `_sum_in_vectors` in interpolation.py. Parameters, for S strands of P points, K slots of guides a
// strand and G guides:
//
//   int strand                              the strand to make
//   vec3 root                               its root [m]
//   vec3 tangent, bitangent, normal         its frame
//   array_t<float> offsets                  (G, groups, 4 * LANES) segments of guides in the frames of their roots [m]:
//                                           of each group of LANES segments all x, then all y, all z, all lengths
//   array_t<int> indices                    (S, K) guides of each strand
//   array_t<float> weights                  (S, K) their weights, zero in unused slots
//   array_t<vec2> turns                     (S, K) cosine and sine of the turn from a guide's frame to the strand's
//   float keep_length                       0 to 1: how far segments are stretched to the guides' mean length
//   array_t<vec3> out_points                (S, P) [m]
//
// Constants:
//
//   LANES                                   segments of a group: floats of a vector
//   SLOT_LIMIT                              most guides of a strand
//   CANCELLED                               fraction of the mean length below which a segment counts as this long
//   LONGEST                                 length [m] above which a segment is not stretched

#if !defined(__CUDA_ARCH__)
{
  typedef float lanes __attribute__((ext_vector_type(LANES)));
  const int point_count = out_points.shape[1];
  const int slot_count = indices.shape[1];
  const int group_count = offsets.shape[1];

  // Vectors moved up by some lanes, with zeros below.
  const auto up_by_1 = [](lanes v) { return __builtin_shufflevector(lanes(0.0f), v, 0, 8, 9, 10, 11, 12, 13, 14); };
  const auto up_by_2 = [](lanes v) { return __builtin_shufflevector(lanes(0.0f), v, 0, 0, 8, 9, 10, 11, 12, 13); };
  const auto up_by_4 = [](lanes v) { return __builtin_shufflevector(lanes(0.0f), v, 0, 0, 0, 0, 8, 9, 10, 11); };

  // The guides with a weight: where their offsets begin, and the factors of those.
  const float* guide[SLOT_LIMIT];
  float share[SLOT_LIMIT], cosine[SLOT_LIMIT], sine[SLOT_LIMIT];
  int guide_count = 0;
  for (int slot = 0; slot < slot_count; ++slot) {
    const size_t place = size_t(strand) * slot_count + slot;
    const float weight = weights.data[place];
    if (weight > 0.0f) {
      guide[guide_count] = offsets.data + size_t(indices.data[place]) * group_count * (4 * LANES);
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
    // Weighted sums over the guides, in the strand's frame.
    lanes x = 0.0f, y = 0.0f, z = 0.0f, length = 0.0f;
    for (int g = 0; g < guide_count; ++g) {
      lanes offset_x, offset_y, offset_z, offset_length;
      const float* its_offsets = guide[g] + group * (4 * LANES);
      __builtin_memcpy(&offset_x, its_offsets, sizeof(lanes));
      __builtin_memcpy(&offset_y, its_offsets + LANES, sizeof(lanes));
      __builtin_memcpy(&offset_z, its_offsets + 2 * LANES, sizeof(lanes));
      __builtin_memcpy(&offset_length, its_offsets + 3 * LANES, sizeof(lanes));
      x += cosine[g] * offset_x - sine[g] * offset_y;
      y += sine[g] * offset_x + cosine[g] * offset_y;
      z += share[g] * offset_z;
      length += share[g] * offset_length;
    }
    const lanes least = __builtin_elementwise_max(CANCELLED * length, lanes(1.0e-30f));
    const lanes found = __builtin_elementwise_max(__builtin_elementwise_sqrt(x * x + y * y + z * z), least);
    lanes stretch = 1.0f + keep_length * (length / found - 1.0f);
    stretch = found < LONGEST ? stretch : lanes(1.0f);
    // Out of the strand's frame.
    lanes along_x = stretch * (tangent[0] * x + bitangent[0] * y + normal[0] * z);
    lanes along_y = stretch * (tangent[1] * x + bitangent[1] * y + normal[1] * z);
    lanes along_z = stretch * (tangent[2] * x + bitangent[2] * y + normal[2] * z);
    // From segments to points: an inclusive scan over the lanes [Harris07], from the last point of the group before.
    along_x += up_by_1(along_x);
    along_y += up_by_1(along_y);
    along_z += up_by_1(along_z);
    along_x += up_by_2(along_x);
    along_y += up_by_2(along_y);
    along_z += up_by_2(along_z);
    along_x += up_by_4(along_x) + last_x;
    along_y += up_by_4(along_y) + last_y;
    along_z += up_by_4(along_z) + last_z;
    last_x = along_x[LANES - 1];
    last_y = along_y[LANES - 1];
    last_z = along_z[LANES - 1];
    // From three vectors to points as they lie in memory: x0 y0 z0 x1 y1 z1 …
    const lanes xy_0 = __builtin_shufflevector(along_x, along_y, 0, 8, 0, 1, 9, 0, 2, 10);
    const lanes xy_1 = __builtin_shufflevector(along_x, along_y, 0, 3, 11, 0, 4, 12, 0, 5);
    const lanes xy_2 = __builtin_shufflevector(along_x, along_y, 13, 0, 6, 14, 0, 7, 15, 0);
    const lanes part_0 = __builtin_shufflevector(xy_0, along_z, 0, 1, 8, 3, 4, 9, 6, 7);
    const lanes part_1 = __builtin_shufflevector(xy_1, along_z, 10, 1, 2, 11, 4, 5, 12, 7);
    const lanes part_2 = __builtin_shufflevector(xy_2, along_z, 0, 13, 2, 3, 14, 5, 6, 15);
    float* to = row + 3 + group * (3 * LANES);
    if (1 + (group + 1) * LANES <= point_count) {
      __builtin_memcpy(to, &part_0, sizeof(lanes));
      __builtin_memcpy(to + LANES, &part_1, sizeof(lanes));
      __builtin_memcpy(to + 2 * LANES, &part_2, sizeof(lanes));
    } else {
      // The last group may be longer than the rest of the strand.
      float whole[3 * LANES];
      __builtin_memcpy(whole, &part_0, sizeof(lanes));
      __builtin_memcpy(whole + LANES, &part_1, sizeof(lanes));
      __builtin_memcpy(whole + 2 * LANES, &part_2, sizeof(lanes));
      for (int number = 0; number < 3 * (point_count - 1 - group * LANES); ++number) to[number] = whole[number];
    }
  }
}
#endif
