// SPDX-License-Identifier: GPL-3.0-or-later
//
// Sums over the points of a guide (guide_weights.py), eight points at once.
//
// The body of `sum_points` in cpu_weights.py. Parameters:
//
//   int guide                     index of the guide
//   array_t<vec3> guide_points    (G, P) [m]
//   array_t<float> out_sums       (G, 8): the sum of unit vectors from the root to the points of the lower half in the
//                                 first three numbers, and the guide's length in the seventh

{
#include "lanes.h"
#include "guide_points.h"

const int point_count = guide_points.shape[1];
const int half = point_count / 2;
const float* guide_row = reinterpret_cast<const float*>(guide_points.data) + size_t(guide) * point_count * 3;
float* sums = out_sums.data + size_t(guide) * 8;
// Sums of every eighth point.
float lower_x[8] = {}, lower_y[8] = {}, lower_z[8] = {}, length[8] = {};
for (int part = 0; part < 8; part += LANES) {
  lanes sum_x = 0.0f, sum_y = 0.0f, sum_z = 0.0f, sum = 0.0f;
  for (int first = 1 + part; first < point_count; first += 8) {
    lanes x, y, z, before_x, before_y, before_z;
    read_points(guide_row, first, point_count, x, y, z);
    read_points(guide_row, first - 1, point_count, before_x, before_y, before_z);
    before_x = x - before_x;
    before_y = y - before_y;
    before_z = z - before_z;
    sum += exact_sqrt_of(before_x * before_x + before_y * before_y + before_z * before_z);
    if (first > half) continue;
    x -= guide_row[0];
    y -= guide_row[1];
    z -= guide_row[2];
    const lanes size = exact_sqrt_of(x * x + y * y + z * z);
    for (int l = 0; l < LANES; ++l) {
      if (first + l > half || !(get_lane(size, l) > 0.0f)) {
        set_lane(x, l, 0.0f);
        set_lane(y, l, 0.0f);
        set_lane(z, l, 0.0f);
      }
    }
    const lanes divisor = size > 0.0f ? size : lanes(1.0f);
    sum_x += exact_quotient_of(x, divisor);
    sum_y += exact_quotient_of(y, divisor);
    sum_z += exact_quotient_of(z, divisor);
  }
  for (int l = 0; l < LANES; ++l) {
    lower_x[part + l] = get_lane(sum_x, l);
    lower_y[part + l] = get_lane(sum_y, l);
    lower_z[part + l] = get_lane(sum_z, l);
    length[part + l] = get_lane(sum, l);
  }
}
sums[0] = sum_of_eight(lower_x);
sums[1] = sum_of_eight(lower_y);
sums[2] = sum_of_eight(lower_z);
sums[6] = sum_of_eight(length);
}
