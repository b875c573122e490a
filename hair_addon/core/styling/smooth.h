// SPDX-License-Identifier: GPL-3.0-or-later
//
// Smooth (smooth.py): directions of chords around each segment, twice. Two marks run along the strand, so the cost does
// not depend on the length of the chords.

const float half = 0.5f * number[8];
vector old[MOST];
for (int i = 1; i < point_count; ++i) old[i] = t[i];
for (int pass = 0; pass < 2; ++pass) {
  put_points();
  marks low, high;
  for (int lane = 0; lane < LANES; ++lane) low[lane] = high[lane] = 0;
  // The point at an arc length, past which the mark of a lane has not moved yet.
  const auto point_at = [&](lanes place, marks& mark) {
    lanes below, above;
    for (int lane = 0; lane < LANES; ++lane) {
      const float wanted = get_lane(place, lane);
      while (mark[lane] < point_count - 2 && lane_of(along[mark[lane] + 1], lane) <= wanted) ++mark[lane];
      set_lane(below, lane, lane_of(along[mark[lane]], lane));
      set_lane(above, lane, lane_of(along[mark[lane] + 1], lane));
    }
    const lanes range = above - below;
    const auto has_range = range > 1.0e-12f;
    const lanes part = has_range ? (place - below) / (has_range ? range : lanes(1.0f)) : lanes(0.0f);
    const vector start = gathered(next, mark, 0);
    return start + (gathered(next, mark, 1) - start) * part;
  };
  for (int i = 1; i < point_count; ++i) {
    const lanes middle = 0.5f * (along[i - 1] + along[i]);
    const lanes back = higher_of(middle - half, lanes(0.0f)), forth = lower_of(middle + half, total);
    u[i] = unit_or(point_at(forth, high) - point_at(back, low), lanes(1.0e-3f) * (forth - back), t[i]);
  }
  for (int i = 1; i < point_count; ++i) t[i] = u[i];
}
lanes arc = 0.0f;
for (int i = 1; i < point_count; ++i) {
  arc += length[i];
  const lanes amount = base * profile(arc * per_total);
  t[i] = unit_or(old[i] * (1.0f - amount) + t[i] * amount, lanes(1.0e-3f), old[i]);
}
