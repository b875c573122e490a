// SPDX-License-Identifier: GPL-3.0-or-later
//
// Whether all points of a strand are outside for certain, so that the strand needs no search. Each point is then closer
// to an earlier point than that point is to any surface, or has moved less since the last search than it may.
//
// The body of `is_free` in free_points.py. Roundings can only make the answer 0. Parameters:
//
//   int strand, row                 index of the strand, and its row in `known`
//   int first_moved                 first point that may move
//   array_t<vec3> points            (S, P) of all strands
//   mat33d axes, vec3d shift        transform of points to the coordinates of the grid [m]
//   DistanceGrid grid               distances from the surfaces
//   float largest_distance          that a surface keeps points away [m]
//   array_t<vec4> known             (rows, P) places of the last search, and how far points may move from there [m]

{
#include "lanes.h"
#include "distance_grid.h"

constexpr float SLACK = 2e-6f;  // of single precision, relative to the coordinates
const int point_count = points.shape[1];
const float* numbers = reinterpret_cast<const float*>(points.data) + size_t(strand) * point_count * 3;
const float* its_known = reinterpret_cast<const float*>(known.data) + size_t(row) * point_count * 4;
float matrix[3][3], offset[3];
for (int i = 0; i < 3; ++i) {
  for (int j = 0; j < 3; ++j) matrix[i][j] = static_cast<float>(axes.data[i][j]);
  offset[i] = static_cast<float>(shift[i]);
}
const auto coordinate = [&](int axis, lanes x, lanes y, lanes z) {
  return matrix[axis][0] * x + matrix[axis][1] * y + matrix[axis][2] * z + offset[axis];
};
// Points from an index on; beyond the tip the tip again.
const auto read = [&](int first, lanes& x, lanes& y, lanes& z) {
  lanes local_x = 0.0f, local_y = 0.0f, local_z = 0.0f;
  for (int l = 0; l < LANES; ++l) {
    const float* from = numbers + 3 * (first + l < point_count ? first + l : point_count - 1);
    set_lane(local_x, l, from[0]);
    set_lane(local_y, l, from[1]);
    set_lane(local_z, l, from[2]);
  }
  x = coordinate(0, local_x, local_y, local_z);
  y = coordinate(1, local_x, local_y, local_z);
  z = coordinate(2, local_x, local_y, local_z);
};
const float far = get_lane(abs_of(lanes(offset[0])) + abs_of(lanes(offset[1])) + abs_of(lanes(offset[2])), 0);
const auto root_of = [&](float square) { return get_lane(exact_sqrt_of(lanes(square)), 0); };
const auto size_of = [&](lanes x, lanes y, lanes z) { return exact_sqrt_of(x * x + y * y + z * z); };

float clear = 0.0f;  // distance that can be traveled before a surface may be near
lanes last_x, last_y, last_z, x, y, z;
read(first_moved - 1, last_x, last_y, last_z);
for (int first = first_moved; first < point_count; first += LANES) {
  read(first, x, y, z);
  // Previous points.
  for (int l = LANES - 1; l > 0; --l) {
    set_lane(last_x, l, get_lane(x, l - 1));
    set_lane(last_y, l, get_lane(y, l - 1));
    set_lane(last_z, l, get_lane(z, l - 1));
  }
  const lanes slack = SLACK * (1.0f + abs_of(x) + abs_of(y) + abs_of(z) + far);
  const lanes step = slack + size_of(x - last_x, y - last_y, z - last_z);
  const lanes away = least_distance(grid, grid.distances.data, x, y, z) - largest_distance - slack;
  const int count = point_count - first < LANES ? point_count - first : LANES;
  for (int l = 0; l < count; ++l) {
    const float its_step = get_lane(step, l), its_away = get_lane(away, l);
    clear -= its_step;
    // Outside like the previous point, if no surface is between the two.
    if (its_away > clear && (clear > 0.0f || its_away > its_step)) clear = its_away;
    if (clear > 0.0f) continue;
    const float* place = its_known + 4 * (first + l);
    const float moved_x = get_lane(x, l) - place[0];
    const float moved_y = get_lane(y, l) - place[1];
    const float moved_z = get_lane(z, l) - place[2];
    clear = place[3] - get_lane(slack, l) - root_of(moved_x * moved_x + moved_y * moved_y + moved_z * moved_z);
    if (!(clear > 0.0f)) return 0;
  }
  set_lane(last_x, 0, get_lane(x, LANES - 1));
  set_lane(last_y, 0, get_lane(y, LANES - 1));
  set_lane(last_z, 0, get_lane(z, LANES - 1));
}
return 1;
}
