// SPDX-License-Identifier: GPL-3.0-or-later
//
// The course of a lock's centre strand, from the styled strand's root on, which rounds less than places do.
//
// begin_course(course) is before the first of middle_at(course, ahead), the point at an arc length of the centre that
// does not decrease; past its tip straight on.

// The points of the centre around the arc length, which are kept while it stays between them.
struct centre_course {
  const float* rows[LANES];
  ints at;
  vector low, high;
  lanes below, above;
};
const auto begin_course = [&](centre_course& course) {
  for (int lane = 0; lane < LANES; ++lane) {
    course.rows[lane] = reinterpret_cast<const float*>(centre_points.data) + size_t(centre[lane]) * point_count * 4;
  }
  course.at = 0;
  lanes row[4];
  read_rows(course.rows, course.at * 4, row);
  course.low = vector{row[0], row[1], row[2]} - root;
  course.below = row[3];
  read_rows(course.rows, course.at * 4 + 4, row);
  course.high = vector{row[0], row[1], row[2]} - root;
  course.above = row[3];
};
const auto middle_at = [&](centre_course& course, lanes ahead) {
  for (;;) {
    const auto is_past = course.above <= ahead && course.at < point_count - 2;
    if (!any_of(is_past)) break;
    course.low = chosen(is_past, course.high, course.low);
    course.below = is_past ? course.above : course.below;
    course.at = is_past ? course.at + 1 : course.at;
    lanes row[4];
    read_rows(course.rows, course.at * 4 + 4, row);
    course.high = vector{row[0], row[1], row[2]} - root;
    course.above = row[3];
  }
  const lanes range = course.above - course.below;
  const auto has_range = range > 1.0e-12f;
  const lanes part = has_range ? (ahead - course.below) / (has_range ? range : lanes(1.0f)) : lanes(0.0f);
  return plus(course.low, course.high - course.low, part);
};
