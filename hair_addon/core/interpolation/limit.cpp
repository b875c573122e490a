// SPDX-License-Identifier: GPL-3.0-or-later
//
// Weights of a strand's guides, reduced for guides that differ too much from the nearest (guide_weights.py).
//
// The body of `limit` in cpu_weights.py. Parameters, for S strands, K slots of guides a strand and G guides:
//
//   int strand, int out_row             the strand whose weights are limited, and the row of its results
//   array_t<int> indices                (S, K) guides of each strand, the nearest first, -1 in unused slots
//   array_t<float> weights              (S, K) their weights
//   array_t<vec2> turns                 (S, K) cosine and sine of the angle from a guide's frame to the strand's
//   array_t<float> shapes               (G, 8) of each guide: unit directions of its lower half and from root to tip,
//                                       in the frame of its root; logarithm of its length; zero
//   float cosine_none, per_cosine       cosine of the angle between directions at which a guide's weight is zero, and
//                                       1 / the range of cosines over which it fades
//   float length_limit, per_length      the same for differences of logarithms, and 1 / half of it, its fading range
//   array_t<float> out_weights          (R, K) weights of sum 1

#include "lanes.h"
#include "guide_rows.h"

// 0 up to the first value, 1 beyond the range, with a smooth step between.
const auto fade = [](float first, float per_range, lanes value) {
  lanes step = (value - first) * per_range;
  step = step < 0.0f ? lanes(0.0f) : step;
  step = step > 1.0f ? lanes(1.0f) : step;
  return step * step * (3.0f - 2.0f * step);
};

const int slot_count = indices.shape[1];
const int* index = indices.data + size_t(strand) * slot_count;
const float* before = weights.data + size_t(strand) * slot_count;
const float* turn = reinterpret_cast<const float*>(turns.data) + size_t(strand) * slot_count * 2;
float* weight = out_weights.data + size_t(out_row) * slot_count;
float lower_1[3], tip_1[3], length_1 = 0.0f;  // of the nearest guide
for (int first = 0; first < slot_count; first += LANES) {
  const int count = slot_count - first < LANES ? slot_count - first : LANES;
  ints guides = -1;
  lanes share = 0.0f, cosine = 1.0f, sine = 0.0f;
  read_lanes(guides, index + first, count);
  read_lanes(share, before + first, count);
  read_pairs(cosine, sine, turn + 2 * first, count);
  lanes row[8];
  read_columns(row, guides, shapes.data);
  const lanes lower_x = cosine * row[0] - sine * row[1], lower_y = sine * row[0] + cosine * row[1];
  const lanes tip_x = cosine * row[3] - sine * row[4], tip_y = sine * row[3] + cosine * row[4];
  if (first == 0) {
    lower_1[0] = get_lane(lower_x, 0), lower_1[1] = get_lane(lower_y, 0), lower_1[2] = get_lane(row[2], 0);
    tip_1[0] = get_lane(tip_x, 0), tip_1[1] = get_lane(tip_y, 0), tip_1[2] = get_lane(row[5], 0);
    length_1 = get_lane(row[6], 0);
  }
  const lanes lower = lower_1[0] * lower_x + lower_1[1] * lower_y + lower_1[2] * row[2];
  const lanes tip = tip_1[0] * tip_x + tip_1[1] * tip_y + tip_1[2] * row[5];
  const lanes facing = lower < tip ? lower : tip;
  const lanes apart = abs_of(row[6] - length_1);
  const lanes facing_fade = fade(cosine_none, per_cosine, facing);
  const lanes length_fade = fade(0.5f * length_limit, per_length, apart);
  lanes left = guides >= 0 ? share * facing_fade * (1.0f - length_fade) : lanes(0.0f);
  if (first == 0) set_lane(left, 0, get_lane(share, 0));
  write_lanes(left, weight + first, count);
}
normalize(weight, slot_count);
