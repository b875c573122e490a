// SPDX-License-Identifier: GPL-3.0-or-later
//
// Points of a guide in lanes. To be included in a function's body after lanes.h; P is its number of points.

// Points P_first, P_(first + 1) … of a guide in the lanes; the tip in lanes past it.
const auto read_points = [&](const float* guide, int first, int point_count, lanes& x, lanes& y, lanes& z) {
  for (int l = 0; l < LANES; ++l) {
    const float* place = guide + 3 * (first + l < point_count ? first + l : point_count - 1);
    set_lane(x, l, place[0]);
    set_lane(y, l, place[1]);
    set_lane(z, l, place[2]);
  }
};
// The sum of eight numbers, in the same order on all devices.
const auto sum_of_eight = [](const float* of) {
  return ((of[0] + of[4]) + (of[2] + of[6])) + ((of[1] + of[5]) + (of[3] + of[7]));
};
