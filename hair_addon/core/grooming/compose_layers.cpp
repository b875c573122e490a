// SPDX-License-Identifier: GPL-3.0-or-later
//
// Points of eight guides with their layers (guide_layers.py).
//
// The body of `_compose_block` in layer_kernels.py. Parameters, for G guides with N points, L layers and
// M chosen guides:
//
//   int block                      of eight chosen guides
//   array_t<int> guides            (M,) the chosen guides
//   array_t<int> starts            (G + 1,) first point of each guide
//   array_t<vec3> base             (N,) the guides without layers
//   array_t<vec3> normals          (G,) unit axes of the root's frame
//   array_t<vec3> tangents         (G,)
//   array_t<uint64> turns          (L,) addresses of each layer's N quaternions w, x, y, z
//   array_t<uint64> stretches      (L,) addresses of each layer's N logarithms of length ratios
//   array_t<float> weights         (L, G) at least 0
//   array_t<vec3> out_points       (N,)

#if !defined(__CUDA_ARCH__)
{
#include "layer_segments.h"

int rows[WIDTH];
for (int lane = 0; lane < WIDTH; ++lane) rows[lane] = point_of(lane, 0);
vector before = vectors_at(base.data, rows);
for (int lane = 0; lane < block_size; ++lane) {
  if (count_of[lane] > 0) out_points.data[first_of[lane]] = base.data[first_of[lane]];
}
for (int place = 1; place < most; ++place) {
  for (int lane = 0; lane < WIDTH; ++lane) rows[lane] = point_of(lane, place);
  const vector point = vectors_at(base.data, rows);
  advance(point - before);
  before = point;
  quaternion turn = no_turn;
  lanes stretch = 0.0f;
  for (int layer = 0; layer < layer_count; ++layer) {
    const lanes weight = weights_of(layer);
    if (!any_of(weight != 0.0f)) continue;
    fetch_ahead(layer, place, rows);
    const quaternion stored = turns_at(layer, rows);
    const auto is_used = is_turn(stored) & (weight != 0.0f);
    if (any_of(is_used)) turn = chosen_turn(is_used, times(turn, part_of(stored, weight)), turn);
    stretch += weight == 0.0f ? lanes(0.0f) : weight * stretches_at(layer, rows);
  }
  const vector found = end_of(point, turn, stretch);
  for (int lane = 0; lane < block_size; ++lane) {
    if (place < count_of[lane]) out_points.data[rows[lane]] = wp::vec3(found.x[lane], found.y[lane], found.z[lane]);
  }
}
}
#endif
