// SPDX-License-Identifier: GPL-3.0-or-later
//
// A program of styles on LANES strands at once: the lanes of a processor's vectors, or one strand per thread of a GPU.
//
// The body of `_apply_steps` in steps.py. Parameters, for S strands of which M are styled, P points per strand, N steps
// and K clump centers of all levels:
//
//   int block                           index of a group of LANES of the M strands
//   array_t<vec3> points                (M, P) [m], styled in place
//   array_t<int> chosen_rows            (M,) their rows among S; empty where M is S
//   array_t<vec3> normals               (S,) unit normals of the surface at the roots
//   array_t<int> identities             (S,) IDs of strands
//   array_t<float> masks                (masks, S) weights, and numbers of steps that differ between strands
//   array_t<int> members                (levels, S) the clump center that each strand belongs to, per level; -1: none
//   array_t<vec4> centre_points         (K, P) points of center strands [m], and the arc length from the root
//   array_t<vec3> centre_normals        (K,)
//   array_t<int> centre_identities      (K,)
//   array_t<int> choices                (N, CHOICES) of steps.py
//   array_t<float> numbers              (N, NUMBERS) of steps.py
//   array_t<float> courses              (C, COURSE_SAMPLES) of courses.py
//   mat44 axes                          from the coordinates of points to the surface's own, without scale
//
// Constants: WIDTH, MOST points per strand, CHOICES, NUMBERS, and those of style_text.py.
//
// A strand is stored as its root, unit directions t_i and lengths d_i of its segments, i = 1 … P - 1. So styles that
// rotate segments keep roots and lengths.

{
#include "lanes.h"
#include "lane_rows.h"
#include "vectors.h"
#include "style_numbers.strand"

const int point_count = points.shape[1];
const int first = block * LANES;
const int left = points.shape[0] - first;
const int lane_count = left < LANES ? left : LANES;
// -1 if these axes are mirrored, by their determinant.
const auto minor = [&](int i, int j) {
  return axes.data[1][i] * axes.data[2][j] - axes.data[1][j] * axes.data[2][i];
};
const float determinant = axes.data[0][0] * minor(1, 2) + axes.data[0][1] * minor(2, 0) + axes.data[0][2] * minor(0, 1);
const float hand = determinant < 0.0f ? -1.0f : 1.0f;
#include "point_rows.h"
// A style that reads directions or lengths after writing them writes to the second array, and swaps.
lanes lengths[2][MOST];
vector directions[2][MOST];
lanes *length = lengths[0], *next_length = lengths[1];
vector *t = directions[0], *next = directions[1];
// Points relative to the root, and their arc lengths, for styles that call `put_points`.
vector place[MOST];
lanes along[MOST];
constexpr int MOST_KEPT = LANES == 1 ? 1 : MOST;
lanes kept_length[MOST_KEPT];
vector kept_t[MOST_KEPT];

const auto swap = [](auto*& a, auto*& b) {
  auto* const kept = a;
  a = b;
  b = kept;
};
#if defined(__CUDA_ARCH__)
const auto bit_count_of = [](int bits) { return __popc(bits); };
#else
const auto bit_count_of = [](int bits) { return __builtin_popcount(bits); };
#endif
// Number `lane` of an entry of such an array.
const auto lane_of = [](const lanes& values, int lane) { return reinterpret_cast<const float*>(&values)[lane]; };

int strand[LANES];
float* rows[LANES];
vector root, normal;
ints identity;
for (int lane = 0; lane < LANES; ++lane) {
  const int row = first + (lane < lane_count ? lane : lane_count - 1);
  strand[lane] = chosen_rows.shape[0] > 0 ? chosen_rows.data[row] : row;
  rows[lane] = reinterpret_cast<float*>(points.data) + size_t(row) * point_count * 3;
  set_lane(normal.x, lane, normals.data[strand[lane]][0]);
  set_lane(normal.y, lane, normals.data[strand[lane]][1]);
  set_lane(normal.z, lane, normals.data[strand[lane]][2]);
  set_lane(identity, lane, identities.data[strand[lane]]);
}
lanes total = 0.0f;
// Directions and lengths of the segments between points. A segment without length has the previous direction.
vector before = normal, point_before;
read_points(rows, [&](int i, const vector& point) {
  if (i == 0) {
    root = point;
  } else {
    const vector segment = point - point_before;
    const lanes size = exact_sqrt_of(dot(segment, segment));
    const auto is_long = size > 1.0e-12f;
    before = chosen(is_long, segment * (1.0f / (is_long ? size : lanes(1.0f))), before);
    t[i] = before;
    length[i] = size;
    total += size;
  }
  point_before = point;
});
ints is_touched = 0;

for (int step = 0; step < numbers.shape[0]; ++step) {
  const int* choice = choices.data + size_t(step) * CHOICES;
  const float* number = numbers.data + size_t(step) * NUMBERS;
  const int kind = choice[0], seed = choice[1], mask = choice[2], level = choice[3], first_centre = choice[4];
  const int varied = choice[5], first_varied = choice[6], packed_courses = choice[7];
  // A number that may differ between strands: a row of `masks` for each bit of `varied`, from `first_varied` on.
  const auto varied_number_at = [&](int place) ALWAYS_INLINE {
    lanes found = number[place];
    if (((varied >> place) & 1) != 0) {
      const int row = first_varied + bit_count_of(varied & ((1 << place) - 1));
      const float* const values = masks.data + size_t(row) * masks.shape[1];
      for (int lane = 0; lane < LANES; ++lane) set_lane(found, lane, values[strand[lane]]);
    }
    return found;
  };
  const lanes keep_length = varied_number_at(KEEP_LENGTH_NUMBER);
  const bool keeps_all_length = !any_of(keep_length != 1.0f);

  // A_si = base · profile(x_i).
  lanes base = varied_number_at(AMOUNT_NUMBER);
  const lanes vary = varied_number_at(VARY_NUMBER);
  if (any_of(vary != 0.0f)) base *= 1.0f - vary * random_number(identity, seed, ints(VARY));
  if (mask >= 0) {
    for (int lane = 0; lane < LANES; ++lane) {
      set_lane(base, lane, get_lane(base, lane) * masks.data[size_t(mask) * masks.shape[1] + strand[lane]]);
    }
  }
  // The clump center of each lane: its ID, and the reference of frames from its normal, which all strands of a clump
  // share. A strand without a center is its own.
  int centre[LANES];
  vector centre_normal = normal;
  ints lock = identity;
  lanes in_lock = 0.0f;
  if (level >= 0) {
    for (int lane = 0; lane < LANES; ++lane) {
      const int member = members.data[size_t(level) * members.shape[1] + strand[lane]];
      centre[lane] = first_centre + (member < 0 ? 0 : member);
      if (member < 0) {
        if ((NEEDING_CENTRE >> kind) & 1) set_lane(base, lane, 0.0f);
        continue;
      }
      set_lane(in_lock, lane, 1.0f);
      set_lane(lock, lane, centre_identities.data[centre[lane]]);
      set_lane(centre_normal.x, lane, centre_normals.data[centre[lane]][0]);
      set_lane(centre_normal.y, lane, centre_normals.data[centre[lane]][1]);
      set_lane(centre_normal.z, lane, centre_normals.data[centre[lane]][2]);
    }
  }

  if (!any_of(base > 0.0f)) continue;
  is_touched = is_touched | (base > 0.0f);
  // Strands excluded by a mask keep their bits.
  const bool is_partial = LANES > 1 && any_of(base <= 0.0f);
  if (is_partial) {
    for (int i = 1; i < point_count; ++i) {
      kept_t[i] = t[i];
      kept_length[i] = length[i];
    }
  }
  const lanes at_root = varied_number_at(AT_ROOT_NUMBER), at_tip = varied_number_at(AT_TIP_NUMBER);
  const lanes exponent = varied_number_at(EXPONENT_NUMBER), from = varied_number_at(FROM_NUMBER);
  const flags is_flipped = varied_number_at(IS_FLIPPED_NUMBER) != 0.0f;
  const bool has_profile = any_of(at_root != at_tip), has_start = any_of(from != 0.0f);
  const bool is_curved = any_of(exponent != 1.0f || is_flipped), has_flipped = any_of(is_flipped);
  const lanes least = 0.5f / (point_count - 1), slope = 1.0f / power(least, 1.0f - exponent);
  const lanes per_total = exact_quotient_of(lanes(1.0f), higher_of(total, lanes(1.0e-20f)));

#include "strand_language.h"
#include "all.strand"

  apply_step();
  if (is_partial) {
    const auto is_styled = base > 0.0f;
    for (int i = 1; i < point_count; ++i) {
      t[i] = chosen(is_styled, t[i], kept_t[i]);
      length[i] = is_styled ? length[i] : kept_length[i];
    }
    put_total();
  }
}

// Strands that no style has changed keep their bits.
vector from_root = {};
write_points(rows, is_touched, [&](int i) {
  if (i > 0) from_root = plus(from_root, t[i], length[i]);
  return root + from_root;
});
}
