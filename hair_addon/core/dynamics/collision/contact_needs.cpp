// SPDX-License-Identifier: GPL-3.0-or-later
//
// Selects which of LANES samples of strands query the surface, and their search radius: in the lanes of vectors on a
// CPU, one sample per thread on a GPU. A sample is skipped if its last distance exceeds its motion relative to the
// surface since, or if the grid of distances shows that it is far away.
//
// The body of `_put_needs` in contact_queries.py. Parameters, of arrays (groups, rows, lanes):
//
//   int group, int sample, int first_lane    the samples
//
// and those of `Query`, of which the names below are fields:
//
//   int is_middle                            1: midpoint of segment `sample`; 0: the vertex after it
//   QueryOptions asking                      is_final: after the solve; is_again: samples that have not moved since
//                                            their last query keep their planes; is_skipping, 0: every sample queries;
//                                            rise: of samples that are inside in the groom [m]
//   Surface surface                          see nearest_surface.py
//   array_t<float> positions, last_positions 3 rows per vertex [m], now and at the start of the substep
//   array_t<float> middle_planes             PLANE rows per segment
//   Samples samples                          rest: distance in the groom [m], changed by `rise`; sides: becomes 0 for
//                                            skipped samples; asked: 3 rows, rest coordinates of the last query [m];
//                                            clear: distance at the last query minus the surface's motion since [m]
//   array_t<float> out_planes                PLANE rows: zero, except for the search radius [m] in the row of the
//                                            offset, and 1 in that of the friction if an adjacent segment has a plane
//
// Returns whether any sample queries the surface, or has an adjacent segment with a plane.
//
// Constants: WIDTH, PLANE, MARGIN, NEAR, MOST_MOTION, SLACK, BACK, STAYED [m].

{
#include "lanes.h"

const auto& surface = query.surface;
const auto& asking = query.asking;
const auto& positions = query.positions;
const auto& last_positions = query.last_positions;
const auto& middle_planes = query.middle_planes;
const auto& samples = query.samples;
const auto& out_planes = query.planes;
const int is_middle = query.is_middle;
const size_t stride = positions.shape[2];
const auto row_of = [&](const auto& array, int row) {
  return array.data + size_t(group) * (array.strides[0] / sizeof(float)) + row * stride + first_lane;
};
#if defined(__CUDA_ARCH__)
const auto get = [](const float* row) { return *row; };
const auto put = [](float* row, lanes values) { *row = values; };
const auto put_ints = [](int* row, ints values) { *row = values; };
const auto get_ints = [](const int* row) { return *row; };
#else
const auto get = [](const float* row) {
  lanes values;
  __builtin_memcpy(&values, row, sizeof(values));
  return values;
};
const auto put = [](float* row, lanes values) { __builtin_memcpy(row, &values, sizeof(values)); };
const auto get_ints = [](const int* row) {
  ints values;
  __builtin_memcpy(&values, row, sizeof(values));
  return values;
};
const auto put_ints = [](int* row, ints values) { __builtin_memcpy(row, &values, sizeof(values)); };
#endif
struct vector {
  lanes x, y, z;
};
const auto length_of = [&](const vector& v) { return exact_sqrt_of(v.x * v.x + v.y * v.y + v.z * v.z); };
const auto lower_of = [](lanes a, lanes b) { return a < b ? a : b; };
const auto higher_of = [](lanes a, lanes b) { return a > b ? a : b; };
const auto get_vector = [&](const auto& array, int row) {
  return vector{get(row_of(array, 3 * row)), get(row_of(array, 3 * row + 1)), get(row_of(array, 3 * row + 2))};
};
const auto between = [](const vector& a, const vector& b) {
  return vector{0.5f * (a.x + b.x), 0.5f * (a.y + b.y), 0.5f * (a.z + b.z)};
};
const auto minus = [](const vector& a, const vector& b) { return vector{a.x - b.x, a.y - b.y, a.z - b.z}; };
const auto turned = [](const wp::mat33& m, const vector& v) {
  return vector{
      m.data[0][0] * v.x + m.data[0][1] * v.y + m.data[0][2] * v.z,
      m.data[1][0] * v.x + m.data[1][1] * v.y + m.data[1][2] * v.z,
      m.data[2][0] * v.x + m.data[2][1] * v.y + m.data[2][2] * v.z};
};
#include "distance_grid.h"
const auto where = [](int condition) { return condition ? ints(-1) : ints(0); };  // in all lanes
const auto is_some = [](const vector& v) { return (v.x != 0.0f) | (v.y != 0.0f) | (v.z != 0.0f); };

const bool is_final = asking.is_final != 0, is_again = asking.is_again != 0;
const auto& now = surface.motions.data[surface.substep];
const float deformation = now.deformation, motion = now.motion, rise = asking.rise;
vector point = get_vector(positions, sample + 1), last = get_vector(last_positions, sample + 1);
lanes segment = lanes(0.0f);
if (is_middle) {
  const vector root = get_vector(positions, sample);
  segment = length_of(minus(point, root));
  point = between(root, point);
  last = between(get_vector(last_positions, sample), last);
}

lanes at_rest = get(row_of(samples.rest, sample));
if (rise > 0.0f) {
  at_rest = at_rest < 0.0f ? lower_of(at_rest + rise, lanes(0.0f)) : at_rest;
  put(row_of(samples.rest, sample), at_rest);
}
const lanes most = lower_of(lanes(surface.largest_distance), at_rest);

// Motion relative to the surface. For colliders without deformation a ray finds crossed surfaces: the search for the
// nearest one is limited to NEAR.
const vector carried = turned(now.carry, last);
const auto& shift = now.carry_shift;
const vector way = minus(point, vector{carried.x + shift[0], carried.y + shift[1], carried.z + shift[2]});
const lanes length = length_of(way);
const lanes moving = lower_of(length, lanes(MOST_MOTION)) + deformation;
lanes needed = abs_of(most) + MARGIN + (deformation > BACK ? moving : lower_of(moving, lanes(NEAR)));

const lanes before = get(row_of(samples.clear, sample));
const lanes left = is_final ? before : before - motion;
const auto& moved = now.moved;
const vector place = turned(now.to_rest, vector{point.x - moved[0], point.y - moved[1], point.z - moved[2]});
const lanes away = length_of(minus(place, get_vector(samples.asked, sample)));
const auto is_spared = (left - away > needed + SLACK) & where(asking.is_skipping);
needed = before < 0.0f ? higher_of(needed, moving + MARGIN - left) : needed;  // inside, possibly deeper
const auto is_kept = (away <= STAYED) & where(is_again);
const auto is_number = length - length == 0.0f;
const auto is_short = (segment <= 2.0f * most) & where(is_middle);
auto is_asking = is_number & !is_spared & !is_short & !is_kept;
if (asking.is_skipping && any_of(is_asking) && surface.distances.shape[0] > 0) {
  // Beyond this distance neither the nearest surface matters, nor can any surface have been crossed.
  const lanes limit = higher_of(needed, length + 2.0f * (deformation + BACK)) + SLACK;
  is_asking = is_asking & !(least_distance(now.grid, surface.distances.data, place.x, place.y, place.z) > limit);
}
ints is_any = is_asking ? ints(1) : ints(0);
if (is_again && !any_of(is_any)) return 0;

put(row_of(samples.clear, sample), is_kept ? before : is_spared ? left : lanes(0.0f));
put_ints(row_of(samples.sides, sample), is_asking | is_kept ? get_ints(row_of(samples.sides, sample)) : ints(0));
const int plane_row = PLANE * (is_middle ? sample : sample + 1);
for (int k = 0; k < PLANE; ++k) {
  const auto row = row_of(out_planes, plane_row + k);
  const lanes value = k == 3 ? (is_asking ? needed : lanes(0.0f)) : lanes(0.0f);
  put(row, is_kept ? get(row) : value);
}
if (!is_middle && !is_final) {
  const int segment_count = positions.shape[1] / 3 - 1;
  const auto has_plane = [&](int index) {
    const int row = PLANE * index;
    return is_some(vector{
        get(row_of(middle_planes, row)), get(row_of(middle_planes, row + 1)), get(row_of(middle_planes, row + 2))});
  };
  auto is_beside = has_plane(sample);
  if (sample + 1 < segment_count) is_beside = is_beside | has_plane(sample + 1);
  put(row_of(out_planes, plane_row + 7), is_beside ? lanes(1.0f) : lanes(0.0f));
  is_any = is_any | (is_beside ? ints(1) : ints(0));
}
return any_of(is_any);
}
