// SPDX-License-Identifier: GPL-3.0-or-later
//
// A program of styles on LANES strands at once: on a processor the lanes of its vectors, on a GPU one strand a thread.
//
// The body of `_apply_steps` in steps.py. Parameters, for S strands in all of which M are styled, P points a strand, N
// steps and K clump centres of all levels together:
//
//   int block                           which LANES of the M strands
//   array_t<vec3> points                (M, P) [m], styled in place
//   array_t<int> chosen_rows            (M,) their rows among S; empty where M is S
//   array_t<vec3> normals               (S,) unit normals of the surface at the roots
//   array_t<int> identities             (S,) what strands are known by
//   array_t<float> masks                (masks, S) weights
//   array_t<int> members                (levels, S) the clump centre that each strand belongs to, per level; -1: none
//   array_t<vec4> centre_points         (K, P) points of centre strands [m], and the arc length from the root
//   array_t<vec3> centre_normals        (K,)
//   array_t<int> centre_identities      (K,)
//   array_t<int> choices                (N, CHOICES) of steps.py
//   array_t<float> numbers              (N, NUMBERS) of steps.py
//   mat44 axes                          from the coordinates of points to the surface's own, without scale
//
// Constants: WIDTH, MOST points a strand, CHOICES, NUMBERS; the kinds and purposes of steps.py.
//
// A strand is held as its root, unit directions t_i and lengths d_i of its segments, i = 1 … P - 1. So a style that
// turns segments keeps roots and lengths.

{
#include "lanes.h"
#include "lane_rows.h"
#include "vectors.h"
#include "style_numbers.h"

using marks = int[LANES];  // a place along the strand of each lane
const int point_count = points.shape[1];
const int first = block * LANES;
const int left = points.shape[0] - first;
const int lane_count = left < LANES ? left : LANES;
// -1 where those own axes are mirrored: by their determinant.
const auto minor = [&](int i, int j) {
  return axes.data[1][i] * axes.data[2][j] - axes.data[1][j] * axes.data[2][i];
};
const float determinant = axes.data[0][0] * minor(1, 2) + axes.data[0][1] * minor(2, 0) + axes.data[0][2] * minor(0, 1);
const float hand = determinant < 0.0f ? -1.0f : 1.0f;
#include "point_rows.h"
// A style writes directions or lengths that it reads again into the second array, and swaps.
lanes lengths[2][MOST];
vector directions[2][MOST];
lanes *length = lengths[0], *next_length = lengths[1];
vector *t = directions[0], *next = directions[1];
// Points from the root on, which round less than places do, and their arc lengths, for styles that ask for them by
// `put_points`.
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
// Number `lane` of an entry of such an array.
const auto lane_of = [](const lanes& values, int lane) { return reinterpret_cast<const float*>(&values)[lane]; };
const auto gathered = [&](const vector* from, const marks& index, int ahead) {
  vector found;
  for (int lane = 0; lane < LANES; ++lane) {
    const vector& entry = from[index[lane] + ahead];
    set_lane(found.x, lane, lane_of(entry.x, lane));
    set_lane(found.y, lane, lane_of(entry.y, lane));
    set_lane(found.z, lane, lane_of(entry.z, lane));
  }
  return found;
};

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
// Directions and lengths of the segments between points. A segment without length goes on as the one before.
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
const auto put_points = [&]() {
  place[0] = {};
  along[0] = 0.0f;
  for (int i = 1; i < point_count; ++i) {
    place[i] = plus(place[i - 1], t[i], length[i]);
    along[i] = along[i - 1] + length[i];
  }
};
// To be called where lengths have changed.
const auto put_total = [&]() {
  total = 0.0f;
  for (int i = 1; i < point_count; ++i) total += length[i];
};
ints is_touched = 0;

for (int step = 0; step < numbers.shape[0]; ++step) {
  const int* choice = choices.data + size_t(step) * CHOICES;
  const float* number = numbers.data + size_t(step) * NUMBERS;
  const int kind = choice[0], seed = choice[1], mask = choice[2], level = choice[3], first_centre = choice[4];
  const auto random = [&](int purpose) { return random_number(identity, seed, ints(purpose)); };

  // A_si = base · profile(x_i).
  lanes base = number[0];
  if (number[1] != 0.0f) base *= 1.0f - number[1] * random(VARY);
  if (mask >= 0) {
    for (int lane = 0; lane < LANES; ++lane) {
      set_lane(base, lane, get_lane(base, lane) * masks.data[size_t(mask) * masks.shape[1] + strand[lane]]);
    }
  }
  // The clump centre of each lane: its identity, and the reference of frames by its normal, which every strand of a
  // clump shares. A strand without a centre stands for itself.
  int centre[LANES];
  vector centre_normal = normal;
  ints lock = identity;
  lanes in_lock = 0.0f;
  if (level >= 0) {
    for (int lane = 0; lane < LANES; ++lane) {
      const int member = members.data[size_t(level) * members.shape[1] + strand[lane]];
      centre[lane] = first_centre + (member < 0 ? 0 : member);
      if (member < 0) {
        if (kind == CLUMP || kind == WEAVE) set_lane(base, lane, 0.0f);
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
  // Strands that a mask leaves out, beside others: they keep their bits.
  const bool is_partial = LANES > 1 && any_of(base <= 0.0f);
  if (is_partial) {
    for (int i = 1; i < point_count; ++i) {
      kept_t[i] = t[i];
      kept_length[i] = length[i];
    }
  }
  const float at_root = number[2], at_tip = number[3], exponent = number[4], from = number[6];
  const bool is_even = at_root == at_tip, is_linear = exponent == 1.0f, is_flipped = number[5] != 0.0f;
  // Within half a segment of its beginning it rises straight: a power would begin vertically, and points jump.
  const lanes least = 0.5f / (point_count - 1), slope = 1.0f / power(least, lanes(1.0f - exponent));
  const auto profile = [&](lanes x) {
    if (is_even) return lanes(at_root);
    // x of the tip is 1 but for rounding, which steep profiles are sensitive to.
    lanes part = 1.000001f * x - from;
    if (from != 0.0f) part = exact_quotient_of(part, lanes(1.0f - from));
    lanes y = clamped(part, lanes(0.0f), lanes(1.0f));
    if (is_flipped || !is_linear) {
      const lanes raised = power(is_flipped ? 1.0f - y : y, lanes(exponent));
      y = is_flipped ? 1.0f - raised : (y < least ? y * slope : raised);
    }
    return lanes(at_root + (at_tip - at_root) * y);
  };
  const lanes per_total = exact_quotient_of(lanes(1.0f), higher_of(total, lanes(1.0e-20f)));

#include "frames.h"
#include "across.h"
#include "centre_course.h"
#include "gather.h"

  switch (kind) {
    case TRIM: {
#include "trim.h"
    } break;
    case CLUMP: {
#include "clump.h"
    } break;
    case CURL: {
#include "beside.h"
#include "curl.h"
    } break;
    case FRIZZ: {
#include "frizz.h"
    } break;
    case BEND: {
#include "bend.h"
    } break;
    case SMOOTH: {
#include "smooth.h"
    } break;
    case WEAVE: {
#include "weave.h"
    } break;
  }
  if (is_partial) {
    const auto is_styled = base > 0.0f;
    for (int i = 1; i < point_count; ++i) {
      t[i] = chosen(is_styled, t[i], kept_t[i]);
      length[i] = is_styled ? length[i] : kept_length[i];
    }
    put_total();
  }
}

// Strands that no style has touched keep their bits.
vector from_root = {};
write_points(rows, is_touched, [&](int i) {
  if (i > 0) from_root = plus(from_root, t[i], length[i]);
  return root + from_root;
});
}
