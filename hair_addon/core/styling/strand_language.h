// SPDX-License-Identifier: GPL-3.0-or-later
//
// The language of .strand files in C++, for LANES strands at once; shaders/strands/strand_language.glsl is its GLSL.
//
// Types: lanes, ints and flags are a number, an integer and a condition of each strand, vector is three numbers. float,
// int and bool are the same for all strands. Every function of a .strand file is inlined, as a lambda.
//
// A strand is its root, unit directions t_i and lengths d_i of its segments, i = 1 … point_count - 1. A style that
// reads directions after writing them writes to the next ones, and swaps them. Include inside the loop over steps.

#define UNROLL _Pragma("unroll")
const vector zero_vector = {};
const auto vector_of = [](lanes x, lanes y, lanes z) { return vector{x, y, z}; };
const auto number_at = [&](int place) { return number[place]; };
// Sine and cosine of an angle in turns: by a GPU's own instructions, error 4e-7, or by polynomials.
const auto sine_and_cosine = [&](lanes turns, lanes& sine, lanes& cosine) ALWAYS_INLINE {
#if defined(__CUDA_ARCH__)
  const lanes x = turns - floor_of(turns + 0.5f);
  sine = __sinf(6.28318530718f * x);
  cosine = __cosf(6.28318530718f * x);
#else
  sine_and_cosine_of(turns, sine, cosine);
#endif
};
// The row of a course of the step, by its place in `COURSES`; -1: none. Values of a row.
const auto course_row = [&](int slot) {
  return HAS_COURSES == 0 ? -1 : ((packed_courses >> (slot * COURSE_BITS)) & ((1 << COURSE_BITS) - 1)) - 1;
};
const auto course_sample = [&](int row, const ints& at) {
  const float* const samples = courses.data + size_t(row) * COURSE_SAMPLES;
  lanes found;
  for (int lane = 0; lane < LANES; ++lane) set_lane(found, lane, samples[get_lane(at, lane)]);
  return found;
};
const auto int_of = [](float value) { return static_cast<int>(value); };
const auto float_of = [](int value) { return static_cast<float>(value); };
const auto root_of = [](float value) { return sqrtf(value); };
const auto random = [&](int purpose) { return random_number(identity, seed, ints(purpose)); };

const auto direction_at = [&](int i) -> const vector& { return t[i]; };
const auto length_at = [&](int i) { return length[i]; };
const auto set_direction = [&](int i, const vector& direction) { t[i] = direction; };
const auto set_length = [&](int i, lanes size) { length[i] = size; };
// The next lengths of segments, for styles that change them.
const bool changes_lengths = ((CHANGING_LENGTHS >> kind) & 1) != 0 || !keeps_all_length;
const auto next_direction_at = [&](int i) -> const vector& { return next[i]; };
const auto next_length_at = [&](int i) { return next_length[i]; };
const auto set_next = [&](int i, const vector& direction, lanes size) {
  next[i] = direction;
  if (changes_lengths) next_length[i] = size;
};
const auto exchange = [&]() {
  swap(t, next);
  if (changes_lengths) swap(length, next_length);
};
// Call after changing lengths.
const auto put_total = [&]() {
  total = 0.0f;
  for (int i = 1; i < point_count; ++i) total += length[i];
};
// Points relative to the root, with smaller rounding errors, and their arc lengths, of present or next directions.
const auto put_points = [&](bool are_next) {
  const vector* const directions_now = are_next ? next : t;
  place[0] = {};
  along[0] = 0.0f;
  for (int i = 1; i < point_count; ++i) {
    place[i] = plus(place[i - 1], directions_now[i], length[i]);
    along[i] = along[i - 1] + length[i];
  }
};
const auto place_at = [&](int i) -> const vector& { return place[i]; };
const auto arc_at = [&](int i) { return along[i]; };
// The same at a point of each strand.
const auto entry_of = [](const ints& at, int lane) { return reinterpret_cast<const int*>(&at)[lane]; };
const auto place_of = [&](ints at) {
  vector found;
  for (int lane = 0; lane < LANES; ++lane) {
    const vector& entry = place[entry_of(at, lane)];
    set_lane(found.x, lane, lane_of(entry.x, lane));
    set_lane(found.y, lane, lane_of(entry.y, lane));
    set_lane(found.z, lane, lane_of(entry.z, lane));
  }
  return found;
};
const auto arc_of = [&](ints at) {
  lanes found;
  for (int lane = 0; lane < LANES; ++lane) set_lane(found, lane, lane_of(along[entry_of(at, lane)], lane));
  return found;
};
// The last point, from `at` on, that is not beyond an arc length and not the tip.
const auto point_before = [&](ints at, lanes arc) {
  for (int lane = 0; lane < LANES; ++lane) {
    int point = entry_of(at, lane);
    const float reached = lane_of(arc, lane);
    while (point < point_count - 2 && lane_of(along[point + 1], lane) < reached) ++point;
    set_lane(at, lane, point);
  }
  return at;
};
// Sets a point, or a segment, of the strands for which a condition holds; others do not change.
const auto take_point = [&](flags is_asked, ints at, vector& point, lanes& arc) {
  const int last = most_of(is_asked ? at : ints(0));
  for (int i = least_of(is_asked ? at : ints(MOST)); i <= last; ++i) {
    const auto is_here = is_asked && at == i;
    arc = is_here ? along[i] : arc;
    point = chosen(is_here, place[i], point);
  }
};
const auto take_segment = [&](flags is_asked, ints at, vector& direction, lanes& size) {
  const int last = most_of(is_asked ? at : ints(0));
  for (int i = least_of(is_asked ? at : ints(MOST)); i <= last; ++i) {
    const auto is_here = is_asked && at == i;
    size = is_here ? length[i] : size;
    direction = chosen(is_here, t[i], direction);
  }
};
// Two numbers of each point, in the memory of the next directions.
const auto set_offset = [&](int i, lanes to_u, lanes to_v) {
  next[i].x = to_u;
  next[i].y = to_v;
};
const auto offset_u_at = [&](int i) { return next[i].x; };
const auto offset_v_at = [&](int i) { return next[i].y; };
// Numbers of each strand that are stored without registers, below SPARES.
const auto keep_number = [&](int k, lanes value) { spare[k] = value; };
const auto kept_number = [&](int k) { return spare[k]; };

// Points of the strands' clump centers, and the arc lengths there. Whether there are any.
const bool has_centre_points = level >= 0 && first_centre < centre_points.shape[0];
const float* centre_rows[LANES];
if (has_centre_points) {
  for (int lane = 0; lane < LANES; ++lane) {
    centre_rows[lane] = reinterpret_cast<const float*>(centre_points.data) + size_t(centre[lane]) * point_count * 4;
  }
}
const auto read_centre = [&](ints at, vector& point, lanes& arc) {
  lanes row[4];
  read_rows(centre_rows, at * 4, row);
  point = vector{row[0], row[1], row[2]};
  arc = row[3];
};

// A position in the surface's own coordinates, and directions between these and the coordinates of points.
const auto place_on_surface = [&](const vector& p) {
  return vector{
      axes.data[0][0] * p.x + axes.data[0][1] * p.y + axes.data[0][2] * p.z + axes.data[0][3],
      axes.data[1][0] * p.x + axes.data[1][1] * p.y + axes.data[1][2] * p.z + axes.data[1][3],
      axes.data[2][0] * p.x + axes.data[2][1] * p.y + axes.data[2][2] * p.z + axes.data[2][3],
  };
};
const auto to_axes = [&](const vector& v) {
  return vector{
      axes.data[0][0] * v.x + axes.data[0][1] * v.y + axes.data[0][2] * v.z,
      axes.data[1][0] * v.x + axes.data[1][1] * v.y + axes.data[1][2] * v.z,
      axes.data[2][0] * v.x + axes.data[2][1] * v.y + axes.data[2][2] * v.z,
  };
};
const auto from_axes = [&](const vector& v) {
  return vector{
      axes.data[0][0] * v.x + axes.data[1][0] * v.y + axes.data[2][0] * v.z,
      axes.data[0][1] * v.x + axes.data[1][1] * v.y + axes.data[2][1] * v.z,
      axes.data[0][2] * v.x + axes.data[1][2] * v.y + axes.data[2][2] * v.z,
  };
};
