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
//   array_t<vec4> turns            (L, N) quaternions w, x, y, z
//   array_t<float> stretches       (L, N) logarithms of length ratios
//   array_t<float> weights         (L, G) at least 0
//   array_t<vec3> out_points       (N,)

#if !defined(__CUDA_ARCH__)
{
#include "layer_segments.h"

doubles shift_x = 0.0, shift_y = 0.0, shift_z = 0.0;
flags is_base = lanes(0.0f) == lanes(0.0f);
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
    const quaternion stored = turns_at(turns.data + layer * point_count, rows);
    const auto is_used = is_turn(stored) & (weight != 0.0f);
    if (any_of(is_used)) turn = chosen_turn(is_used, times(turn, part_of(stored, weight)), turn);
    stretch += weight == 0.0f ? lanes(0.0f) : weight * numbers_at(stretches.data + layer * point_count, rows);
  }
  const auto is_changed = is_bent(turn) | (stretch != 0.0f);
  if (any_of(is_changed)) {
    const vector local = unit_of(turned(unit_turn(turn), up));
    lanes length = along.length;
    if (any_of(stretch != 0.0f)) {
      const lanes ratio = exponential(clamped(stretch, lanes(-LONGEST), lanes(LONGEST)));
      length = stretch != 0.0f ? higher_of(length, short_length) * ratio : length;
    }
    const vector after = (along.tangent * local.x + along.side * local.y + along.direction * local.z) * length;
    const vector shift = chosen(is_changed, after - along.segment, zero);
    shift_x += __builtin_convertvector(shift.x, doubles);
    shift_y += __builtin_convertvector(shift.y, doubles);
    shift_z += __builtin_convertvector(shift.z, doubles);
    is_base &= is_changed == 0;
  }
  const lanes x = __builtin_convertvector(__builtin_convertvector(point.x, doubles) + shift_x, lanes);
  const lanes y = __builtin_convertvector(__builtin_convertvector(point.y, doubles) + shift_y, lanes);
  const lanes z = __builtin_convertvector(__builtin_convertvector(point.z, doubles) + shift_z, lanes);
  const vector found = chosen(is_base, point, vector{x, y, z});
  for (int lane = 0; lane < block_size; ++lane) {
    if (place < count_of[lane]) out_points.data[rows[lane]] = wp::vec3(found.x[lane], found.y[lane], found.z[lane]);
  }
}
}
#endif
