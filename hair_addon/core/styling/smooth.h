// SPDX-License-Identifier: GPL-3.0-or-later
//
// Smooth (smooth.py): directions of chords around each segment, twice. Two places run along the strand, so the cost
// does not depend on the length of the chords.

const float half = 0.5f * number[8];
vector old[MOST];
for (int i = 1; i < point_count; ++i) old[i] = t[i];
for (int pass = 0; pass < 2; ++pass) {
  put_points();
  // Two places that run along the strand, between two points of it each.
  struct runner {
    ints at;
    lanes below, above;
    vector start, end;
  };
  runner behind = {ints(0), along[0], along[1], place[0], place[1]}, before = behind;
  const auto point_at = [&](lanes arc, runner& run) {
    for (;;) {
      const auto is_past = run.above <= arc && run.at < point_count - 2;
      if (!any_of(is_past)) break;
      run.below = is_past ? run.above : run.below;
      run.start = chosen(is_past, run.end, run.start);
      run.at = is_past ? run.at + 1 : run.at;
      const int last = most_of(is_past ? run.at : ints(0));
      for (int k = least_of(is_past ? run.at : ints(MOST)); k <= last; ++k) {
        const auto is_here = is_past && run.at == k;
        run.above = is_here ? along[k + 1] : run.above;
        run.end = chosen(is_here, place[k + 1], run.end);
      }
    }
    const lanes range = run.above - run.below;
    const auto has_range = range > 1.0e-12f;
    const lanes part = has_range ? (arc - run.below) / (has_range ? range : lanes(1.0f)) : lanes(0.0f);
    return plus(run.start, run.end - run.start, part);
  };
  for (int i = 1; i < point_count; ++i) {
    const lanes middle = 0.5f * (along[i - 1] + along[i]);
    const lanes back = higher_of(middle - half, lanes(0.0f)), forth = lower_of(middle + half, total);
    next[i] = unit_or(point_at(forth, before) - point_at(back, behind), lanes(1.0e-3f) * (forth - back), t[i]);
  }
  swap(t, next);
}
lanes arc = 0.0f;
for (int i = 1; i < point_count; ++i) {
  arc += length[i];
  const lanes amount = base * profile(arc * per_total);
  t[i] = unit_or(plus(old[i] * (1.0f - amount), t[i], amount), lanes(1.0e-3f), old[i]);
}
