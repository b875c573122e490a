// SPDX-License-Identifier: GPL-3.0-or-later
//
// Segments of LANES guides at once, with their frames and the turns of their layers. To be included at the top of the
// body of a function with the parameters of `_compose_block` in layer_kernels.py.
//
// Each lane is one guide: its result does not depend on the guides in other lanes.

#include "lanes.h"
#include "vectors.h"

typedef double doubles __attribute__((ext_vector_type(WIDTH)));
typedef float four __attribute__((ext_vector_type(4), aligned(4)));
static_assert(WIDTH == 8, "the transposition below is that of eight lanes");

struct quaternion {
  lanes w, x, y, z;
};
const quaternion no_turn{lanes(1.0f), lanes(0.0f), lanes(0.0f), lanes(0.0f)};
const vector zero{lanes(0.0f), lanes(0.0f), lanes(0.0f)};
const vector up{lanes(0.0f), lanes(0.0f), lanes(1.0f)};
constexpr float SHORT = 1e-6f;     // of a guide's mean segment: shorter segments have no length to multiply
constexpr float LONGEST = 30.0f;   // limit of logarithms of length ratios
constexpr float PI = 3.14159265f;

const auto times = [&](const quaternion& a, const quaternion& b) {
  return quaternion{a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                    a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z, a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x};
};
const auto chosen_turn = [&](auto condition, const quaternion& a, const quaternion& b) {
  return quaternion{condition ? a.w : b.w, condition ? a.x : b.x, condition ? a.y : b.y, condition ? a.z : b.z};
};
const auto unit_turn = [&](const quaternion& a) {
  const lanes scale = 1.0f / exact_sqrt_of(a.w * a.w + a.x * a.x + a.y * a.y + a.z * a.z);
  return quaternion{a.w * scale, a.x * scale, a.y * scale, a.z * scale};
};
const auto turned = [&](const quaternion& turn, const vector& v) {
  const vector axis{turn.x, turn.y, turn.z};
  const vector twice = cross(axis, v) * lanes(2.0f);
  return v + twice * turn.w + cross(axis, twice);
};
const auto is_bent = [&](const quaternion& a) { return (a.x != 0.0f) | (a.y != 0.0f); };
const auto is_turn = [&](const quaternion& a) { return (a.x != 0.0f) | (a.y != 0.0f) | (a.z != 0.0f); };
const auto size_of = [&](const vector& v) { return exact_sqrt_of(dot(v, v)); };
const auto divided = [&](const vector& v, lanes by) {
  return v * (by > 0.0f ? 1.0f / (by > 0.0f ? by : lanes(1.0f)) : lanes(0.0f));
};
const auto unit_of = [&](const vector& v) { return divided(v, size_of(v)); };

// Polynomials of least error: 2e-8 for the arctangent, 4e-9 for the sine, 3e-9 for the exponential, 2e-10 for the
// logarithm.
const auto angle_of = [&](lanes sine, lanes cosine) {  // in [0, π]; sine at least 0
  const lanes size = abs_of(cosine);
  const auto is_steep = sine > size;
  const lanes below = is_steep ? sine : size;
  const lanes x = (is_steep ? size : sine) / (below > 0.0f ? below : lanes(1.0f));
  const lanes z = x * x;
  lanes sum = fused(lanes(0.0029745898f), z, lanes(-0.0165811817f));
  sum = fused(sum, z, lanes(0.0435535357f));
  sum = fused(sum, z, lanes(-0.0758057783f));
  sum = fused(sum, z, lanes(0.1067894015f));
  sum = fused(sum, z, lanes(-0.142142091f));
  sum = fused(sum, z, lanes(0.199941372f));
  sum = fused(sum, z, lanes(-0.3333316697f));
  lanes angle = fused(x * z, sum, x);
  angle = is_steep ? 0.5f * PI - angle : angle;
  return cosine < 0.0f ? PI - angle : angle;
};
const auto sine_and_cosine = [&](lanes angle, lanes& sine, lanes& cosine) {
  const lanes quarter = floor_of(fused(angle, lanes(2.0f / PI), lanes(0.5f)));
  const lanes r = fused(quarter, lanes(4.37113883e-8f), fused(quarter, lanes(-1.57079637f), angle));
  const lanes z = r * r;
  const lanes sine_sum = fused(fused(lanes(-0.000195173f), z, lanes(0.0083321781f)), z, lanes(-0.1666665494f));
  const lanes cosine_sum = fused(fused(lanes(2.4438451549e-5f), z, lanes(-1.3887367515e-3f)), z, lanes(0.041666647f));
  const lanes s = fused(r * z, sine_sum, r);
  const lanes c = fused(z * z, cosine_sum, fused(lanes(-0.5f), z, lanes(1.0f)));
  const ints turn = to_ints(quarter);
  const auto is_odd = (turn & 1) != 0;
  sine = is_odd ? c : s;
  cosine = is_odd ? s : c;
  sine = (turn & 2) != 0 ? -sine : sine;
  cosine = ((turn + 1) & 2) != 0 ? -cosine : cosine;
};
const auto exponential = [&](lanes x) {  // of -60 to 60
  const lanes n = floor_of(fused(x, lanes(1.44269504f), lanes(0.5f)));
  const lanes r = fused(n, lanes(1.90465421e-9f), fused(n, lanes(-0.693147182f), x));
  lanes sum = fused(lanes(0.0013950479f), r, lanes(0.0083688822f));
  sum = fused(sum, r, lanes(0.041666206f));
  sum = fused(sum, r, lanes(0.166665189f));
  sum = fused(sum, r, lanes(0.5000000095f));
  return fused(r * r, sum, r + 1.0f) * lanes_of_bits((to_ints(n) + 127) << 23);
};
const auto logarithm = [&](lanes x) {  // of normal numbers
  const ints shifted = bits_of_lanes(x) - 0x3f3504f3;
  const ints n = shifted >> 23;
  const lanes m = lanes_of_bits((shifted & 0x007fffff) + 0x3f3504f3);  // from √½ to √2
  const lanes s = (m - 1.0f) / (m + 1.0f), z = s * s;
  const lanes series = fused(fused(lanes(0.2996172066f), z, lanes(0.3997358637f)), z, lanes(0.6666681685f));
  const lanes found = fused(s * z, series, 2.0f * s);
  return fused(to_lanes(n), lanes(0.693147182f), fused(to_lanes(n), lanes(-1.90465421e-9f), found));
};

// A part of a turn; stored angles are below two full turns. A weight of 1 is the turn itself.
const auto part_of = [&](const quaternion& stored, lanes weight) {
  const auto is_whole = weight == 1.0f;
  if (!any_of(is_whole == 0)) return stored;
  const lanes sine = exact_sqrt_of(stored.x * stored.x + stored.y * stored.y + stored.z * stored.z);
  lanes part_sine, cosine;
  sine_and_cosine(weight * angle_of(sine, stored.w), part_sine, cosine);
  const lanes scale = part_sine / (sine > 0.0f ? sine : lanes(1.0f));
  const quaternion part{cosine, stored.x * scale, stored.y * scale, stored.z * scale};
  return chosen_turn(is_whole, stored, part);
};

// The least rotation between unit vectors. Opposite vectors have a half turn about an axis across both.
const auto least_turn = [&](const vector& start, const vector& end) {
  const lanes cosine = dot(start, end);
  const auto is_opposite = cosine < -0.999999f;
  const vector axis = cross(start, end);
  quaternion turn = unit_turn(quaternion{is_opposite ? lanes(1.0f) : 1.0f + cosine, axis.x, axis.y, axis.z});
  if (any_of(is_opposite)) {
    const vector first{lanes(0.0f), start.z, -start.y}, second{-start.z, lanes(0.0f), start.x};
    const vector aside = unit_of(chosen(size_of(first) < 0.1f, second, first));
    const vector across = unit_of(aside - end * (0.5f * dot(aside, end)));
    turn = chosen_turn(is_opposite, quaternion{lanes(0.0f), across.x, across.y, across.z}, turn);
  }
  return turn;
};

// The guides of the lanes. Lanes without a guide repeat the last of the block, and write nothing.
int guide_of[WIDTH], first_of[WIDTH], count_of[WIDTH];
int most = 0;
const int guides_left = static_cast<int>(guides.shape[0]) - block * WIDTH;
const int block_size = guides_left < WIDTH ? guides_left : WIDTH;
for (int lane = 0; lane < WIDTH; ++lane) {
  const int guide = guides.data[block * WIDTH + (lane < block_size ? lane : block_size - 1)];
  guide_of[lane] = guide;
  count_of[lane] = starts.data[guide + 1] - starts.data[guide];
  first_of[lane] = count_of[lane] > 0 ? starts.data[guide] : 0;
  if (count_of[lane] > most) most = count_of[lane];
}
// Index of a guide's point, or of its last one.
const auto point_of = [&](int lane, int place) {
  const int last = count_of[lane] - 1;
  return first_of[lane] + (place < last ? place : last > 0 ? last : 0);
};
const auto vectors_at = [&](const wp::vec3* values, const int* rows) {
  vector found = zero;
#pragma clang loop unroll(full)
  for (int lane = 0; lane < WIDTH; ++lane) {
    const float* value = reinterpret_cast<const float*>(values + rows[lane]);
    found.x[lane] = value[0];
    found.y[lane] = value[1];
    found.z[lane] = value[2];
  }
  return found;
};
const auto numbers_at = [&](const float* values, const int* rows) {
  lanes found = 0.0f;
#pragma clang loop unroll(full)
  for (int lane = 0; lane < WIDTH; ++lane) found[lane] = values[rows[lane]];
  return found;
};
const auto finite_of = [&](lanes x) { return x - x == 0.0f ? x : lanes(0.0f); };
const auto turns_of = [&](int layer) { return reinterpret_cast<const wp::vec4*>(turns.data[layer]); };
const auto stretches_of = [&](int layer) { return reinterpret_cast<const float*>(stretches.data[layer]); };
const auto turns_at = [&](int layer, const int* rows) {
  const wp::vec4* values = turns_of(layer);
  const auto pair = [&](int lane) {
    const four low = *reinterpret_cast<const four*>(values + rows[lane]);
    const four high = *reinterpret_cast<const four*>(values + rows[lane + 4]);
    return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
  };
  const lanes r0 = pair(0), r1 = pair(1), r2 = pair(2), r3 = pair(3);
  const lanes low_01 = __builtin_shufflevector(r0, r1, 0, 8, 1, 9, 4, 12, 5, 13);
  const lanes high_01 = __builtin_shufflevector(r0, r1, 2, 10, 3, 11, 6, 14, 7, 15);
  const lanes low_23 = __builtin_shufflevector(r2, r3, 0, 8, 1, 9, 4, 12, 5, 13);
  const lanes high_23 = __builtin_shufflevector(r2, r3, 2, 10, 3, 11, 6, 14, 7, 15);
  return quaternion{finite_of(__builtin_shufflevector(low_01, low_23, 0, 1, 8, 9, 4, 5, 12, 13)),
                    finite_of(__builtin_shufflevector(low_01, low_23, 2, 3, 10, 11, 6, 7, 14, 15)),
                    finite_of(__builtin_shufflevector(high_01, high_23, 0, 1, 8, 9, 4, 5, 12, 13)),
                    finite_of(__builtin_shufflevector(high_01, high_23, 2, 3, 10, 11, 6, 7, 14, 15))};
};
const auto stretches_at = [&](int layer, const int* rows) { return finite_of(numbers_at(stretches_of(layer), rows)); };

const int layer_count = static_cast<int>(weights.shape[0]);
const size_t guide_count = weights.shape[1];
// Fetches what the next block needs of a layer at the same places: a line of memory is four turns, or 16 stretches.
const int ahead = first_of[WIDTH - 1] + count_of[WIDTH - 1] - first_of[0];
const auto fetch_ahead = [&](int layer, int place, const int* rows) {
  if (place % 4 == 1) {
    for (int lane = 0; lane < WIDTH; ++lane) __builtin_prefetch(turns_of(layer) + ahead + rows[lane]);
  }
  if (place % 16 == 1) {
    for (int lane = 0; lane < WIDTH; ++lane) __builtin_prefetch(stretches_of(layer) + ahead + rows[lane]);
  }
};
// Weights of a layer, which are zero in all lanes of a hidden layer.
const auto weights_of = [&](int layer) { return numbers_at(weights.data + layer * guide_count, guide_of); };

// The length below which a segment counts as none.
lanes short_length = 0.0f;
{
  int rows[WIDTH];
  for (int lane = 0; lane < WIDTH; ++lane) rows[lane] = point_of(lane, 0);
  vector before = vectors_at(base.data, rows);
  for (int place = 1; place < most; ++place) {
    for (int lane = 0; lane < WIDTH; ++lane) rows[lane] = point_of(lane, place);
    const vector point = vectors_at(base.data, rows);
    short_length += size_of(point - before);
    before = point;
  }
  for (int lane = 0; lane < WIDTH; ++lane) {
    short_length[lane] = SHORT * short_length[lane] / static_cast<float>(count_of[lane] > 2 ? count_of[lane] - 1 : 1);
  }
}

// The frame of a segment, carried from the frame of the root by least rotations along the base [Bishop75].
struct frame {
  vector tangent, side, direction, segment;
  lanes length;
};
frame along{unit_of(vectors_at(tangents.data, guide_of)), zero, unit_of(vectors_at(normals.data, guide_of)), zero,
            lanes(0.0f)};
const auto advance = [&](const vector& segment) {
  const vector before = along.direction, tangent = along.tangent;
  along.segment = segment;
  along.length = size_of(segment);
  along.direction = chosen(along.length > short_length, divided(segment, along.length), before);
  const lanes total = 1.0f + dot(before, along.direction);
  const auto is_facing = total > 1e-6f;
  const lanes lean = is_facing ? dot(tangent, along.direction) / (is_facing ? total : lanes(1.0f)) : lanes(0.0f);
  vector found = tangent - (before + along.direction) * lean;
  found = found - along.direction * dot(found, along.direction);
  along.tangent = unit_of(chosen(size_of(found) < 1e-6f, tangent, found));
  along.side = cross(along.direction, along.tangent);
};

// The end of the present segment with a turn and a stretch; point: its end in the base. Sums are in double precision.
doubles shift_x = 0.0, shift_y = 0.0, shift_z = 0.0;
flags is_base = lanes(0.0f) == lanes(0.0f);
const auto end_of = [&](const vector& point, const quaternion& turn, lanes stretch) {
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
  return chosen(is_base, point, vector{x, y, z});
};
