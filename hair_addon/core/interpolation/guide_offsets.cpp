// SPDX-License-Identifier: GPL-3.0-or-later
//
// Segments of a guide in the frame of its root (interpolation.py), eight at once.
//
// The body of `_frame_segments` in interpolation.py. Parameters:
//
//   int guide                     index of the guide
//   vec3 tangent, bitangent, normal   its frame
//   array_t<vec3> guide_points    (G, P) [m]
//   array_t<float> out_offsets    (G, groups, 4 * SEGMENTS) as read by interpolation.cpp
//
// Returns the guide's length [m].

{
#include "lanes.h"
#include "guide_points.h"

const int point_count = guide_points.shape[1];
const float* guide_row = reinterpret_cast<const float*>(guide_points.data) + size_t(guide) * point_count * 3;
float* row = out_offsets.data + size_t(guide) * out_offsets.shape[1] * (4 * SEGMENTS);
float lengths[8];
for (int part = 0; part < SEGMENTS; part += LANES) {
  lanes sum = 0.0f;
  for (int group = 0; group < out_offsets.shape[1]; ++group) {
    const int first = 1 + SEGMENTS * group + part;
    lanes x, y, z, before_x, before_y, before_z;
    read_points(guide_row, first, point_count, x, y, z);
    read_points(guide_row, first - 1, point_count, before_x, before_y, before_z);
    x -= before_x;
    y -= before_y;
    z -= before_z;
    const lanes parts[4] = {
        tangent[0] * x + tangent[1] * y + tangent[2] * z,
        bitangent[0] * x + bitangent[1] * y + bitangent[2] * z,
        normal[0] * x + normal[1] * y + normal[2] * z,
        exact_sqrt_of(x * x + y * y + z * z)};
    sum += parts[3];
    float* to = row + group * (4 * SEGMENTS);
#if defined(__CUDA_ARCH__)
    for (int i = 0; i < 4; ++i) to[4 * part + i] = parts[i];
#else
    __builtin_memcpy(to, parts, sizeof(parts));
#endif
  }
  for (int l = 0; l < LANES; ++l) lengths[part + l] = get_lane(sum, l);
}
return sum_of_eight(lengths);
}
