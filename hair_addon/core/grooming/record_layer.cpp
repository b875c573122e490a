// SPDX-License-Identifier: GPL-3.0-or-later
//
// Turns and stretches with which a layer makes eight edited guides (guide_layers.py).
//
// The body of `_record_block` in layer_kernels.py. Parameters as of compose_layers.cpp, and:
//
//   int active                     the layer
//   array_t<vec3> points           (N,) points of the edited guides
//   float tolerance                of a guide's extent: smaller differences are rounding
//   array_t<vec4> out_turns        (N,) of the layer
//   array_t<float> out_stretches   (N,)
//   array_t<int> out_is_made       (M,) 1 for guides whose edited points the layers give after the change

#if !defined(__CUDA_ARCH__)
{
#include "layer_segments.h"

constexpr float MOST_HALF = 3.14f;  // half of the largest angle that a quaternion stores
const lanes own = weights_of(active);
int rows[WIDTH];
for (int lane = 0; lane < WIDTH; ++lane) rows[lane] = point_of(lane, 0);
vector before = vectors_at(base.data, rows), edited_before = vectors_at(points.data, rows);
vector wanted = along.direction;
// The largest difference between edited points and those of the layers, and the extent of each guide.
lanes most_apart = 0.0f, extent = 0.0f, counts = 0.0f;
flags is_finite = lanes(0.0f) == lanes(0.0f);
for (int lane = 0; lane < WIDTH; ++lane) counts[lane] = static_cast<float>(count_of[lane]);
const auto compare = [&](int place, const vector& given, const vector& edited) {
  const vector apart{abs_of(given.x - edited.x), abs_of(given.y - edited.y), abs_of(given.z - edited.z)};
  const lanes sum = apart.x + apart.y + apart.z;
  const lanes largest = higher_of(apart.x, higher_of(apart.y, apart.z));
  const lanes size = higher_of(abs_of(given.x), higher_of(abs_of(given.y), abs_of(given.z)));
  const auto is_there = counts > static_cast<float>(place);
  is_finite &= (is_there == 0) | (sum - sum == 0.0f);
  most_apart = is_there ? higher_of(most_apart, largest) : most_apart;
  extent = is_there ? higher_of(extent, size) : extent;
};
compare(0, before, edited_before);
for (int place = 1; place < most; ++place) {
  for (int lane = 0; lane < WIDTH; ++lane) rows[lane] = point_of(lane, place);
  const vector point = vectors_at(base.data, rows), edited = vectors_at(points.data, rows);
  advance(point - before);
  before = point;
  const vector edited_segment = edited - edited_before;
  edited_before = edited;
  quaternion below = no_turn, above = no_turn;
  lanes stretch = 0.0f;
  for (int layer = 0; layer < layer_count; ++layer) {
    const lanes weight = weights_of(layer);
    if (layer == active || !any_of(weight != 0.0f)) continue;
    fetch_ahead(layer, place, rows);
    const quaternion stored = turns_at(layer, rows);
    const auto is_used = is_turn(stored) & (weight != 0.0f);
    quaternion& product = layer < active ? below : above;
    if (any_of(is_used)) product = chosen_turn(is_used, times(product, part_of(stored, weight)), product);
    stretch += weight == 0.0f ? lanes(0.0f) : weight * stretches_at(layer, rows);
  }
  const lanes edited_length = size_of(edited_segment);
  wanted = chosen(edited_length > short_length, divided(edited_segment, edited_length), wanted);
  below = unit_turn(below);
  const vector in_frame{dot(along.tangent, wanted), dot(along.side, wanted), dot(along.direction, wanted)};
  const vector local = unit_of(turned(quaternion{below.w, -below.x, -below.y, -below.z}, in_frame));
  quaternion turn = least_turn(up, local);
  const auto is_below_others = is_bent(above);
  if (any_of(is_below_others)) {
    // The layers above turn another direction to the wanted one: the least change of the present turn.
    const quaternion stored = turns_at(active, rows);
    const quaternion present = chosen_turn(is_turn(stored), unit_turn(part_of(stored, own)), no_turn);
    const vector now = unit_of(turned(present, unit_of(turned(unit_turn(above), up))));
    turn = chosen_turn(is_below_others, times(least_turn(now, local), present), turn);
  }
  turn = chosen_turn(turn.w < 0.0f, quaternion{-turn.w, -turn.x, -turn.y, -turn.z}, turn);
  if (any_of(own != 1.0f)) {
    const lanes sine = exact_sqrt_of(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z);
    lanes part_sine, cosine;
    sine_and_cosine(lower_of(angle_of(sine, turn.w) / own, lanes(MOST_HALF)), part_sine, cosine);
    const lanes scale = part_sine / (sine > 0.0f ? sine : lanes(1.0f));
    const quaternion whole{cosine, turn.x * scale, turn.y * scale, turn.z * scale};
    turn = chosen_turn((own != 1.0f) & (sine > 0.0f), whole, turn);
  }
  const lanes least = short_length > 0.0f ? short_length : lanes(1.0f);
  const lanes quotient = higher_of(edited_length, least) / higher_of(along.length, least);
  const lanes ratio = short_length > 0.0f ? logarithm(quotient) : lanes(0.0f);
  const lanes found = clamped((ratio - stretch) / own, lanes(-LONGEST), lanes(LONGEST));
  for (int lane = 0; lane < block_size; ++lane) {
    if (place >= count_of[lane]) continue;
    out_turns.data[rows[lane]] = wp::vec4(turn.w[lane], turn.x[lane], turn.y[lane], turn.z[lane]);
    out_stretches.data[rows[lane]] = found[lane];
  }
  const quaternion whole = times(times(below, part_of(turn, own)), above);
  compare(place, end_of(point, whole, stretch + own * found), edited);
}
const flags is_made = is_finite & (most_apart <= tolerance * extent);
for (int lane = 0; lane < block_size; ++lane) out_is_made.data[block * WIDTH + lane] = is_made[lane] != 0;
}
#endif
