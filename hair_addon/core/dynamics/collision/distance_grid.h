// SPDX-License-Identifier: GPL-3.0-or-later
//
// Lower bound of the distance [m] of points from any surface, by a `GridPlace` or `DistanceGrid` and its distances. To
// be included after lanes.h.

const auto least_distance = [&](const auto& grid, const float* distances, lanes x, lanes y, lanes z) {
  const auto size_of = [&](lanes a, lanes b, lanes c) { return exact_sqrt_of(a * a + b * b + c * c); };
  // The closest place to a point in a box that contains all triangles, and the grid vertex nearest to this place.
  const auto inside_of = [&](lanes along, int axis) {
    const lanes most = lanes(grid.size * static_cast<float>(grid.last[axis]));
    along = along < most ? along : most;
    return along > 0.0f ? along : lanes(0.0f);
  };
  x -= grid.low[0];
  y -= grid.low[1];
  z -= grid.low[2];
  const lanes inside_x = inside_of(x, 0), inside_y = inside_of(y, 1), inside_z = inside_of(z, 2);
  const auto beside = [&](lanes along) { return to_ints(along * (1.0f / grid.size) + 0.5f); };
  const ints i = beside(inside_x), j = beside(inside_y), k = beside(inside_z);
  const ints index = (i * (grid.last[1] + 1) + j) * (grid.last[2] + 1) + k;
  lanes distance = lanes(0.0f);
  for (int l = 0; l < LANES; ++l) set_lane(distance, l, distances[get_lane(index, l)]);
  const auto from_vertex = [&](lanes along, ints vertex) { return along - to_lanes(vertex) * grid.size; };
  distance -= size_of(from_vertex(inside_x, i), from_vertex(inside_y, j), from_vertex(inside_z, k)) + grid.drift;
  distance = distance > 0.0f ? distance : lanes(0.0f);
  // All triangles are beyond this place.
  const lanes beyond = size_of(x - inside_x, y - inside_y, z - inside_z) - grid.drift;
  return size_of(distance, beyond > 0.0f ? beyond : lanes(0.0f), lanes(0.0f));
};
