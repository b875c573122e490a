// SPDX-License-Identifier: GPL-3.0-or-later
//
// Strands that gather around their centre strand: they follow the curve of points q that are drawn to it, as far as
// their own length goes. So what is drawn onto the centre lies on it.
//
// offset(arc length of the centre, how far it is drawn, out u, out v) moves q in the centre's frames, by `width` [m] at
// most; 0 for none.

const auto gather = [&](float thickness, float twist, lanes joined, float width, auto offset) {
  const bool is_woven = width > 0.0f;
  const float* rows[LANES];
  for (int lane = 0; lane < LANES; ++lane) {
    rows[lane] = reinterpret_cast<const float*>(centre_points.data) + size_t(centre[lane]) * point_count * 4;
  }
  // All points are from the root on, which round less than places do.
  // The points of the centre around the strand's progress, which are kept while it stays between them.
  ints at = 0;
  lanes row[4];
  read_rows(rows, at * 4, row);
  vector low = vector{row[0], row[1], row[2]} - root;
  lanes below = row[3];
  read_rows(rows, at * 4 + 4, row);
  vector high = vector{row[0], row[1], row[2]} - root;
  lanes above = row[3];
  // Roots stay: what the profile asks for at the root is reached over twice the distance to the centre.
  const lanes root_distance = 2.0f * sqrt_of(dot(low, low));
  const auto is_apart = root_distance > 1.0e-9f;
  const lanes per_root_distance = is_apart ? 1.0f / (is_apart ? root_distance : lanes(1.0f)) : lanes(1.0e9f);
  vector point = {}, place = {}, drawn_before = {}, middle_before = low;
  vector axis_before = centre_normal, frame = reference(), run = {}, own_run = t[1];
  lanes arc = 0.0f, ahead = 0.0f, rate = 1.0f, lead = 0.0f, weight = 0.0f, pull_before = 0.0f;
  for (int i = 1; i < point_count; ++i) {
    const lanes d = length[i];
    arc += d;
    point = point + t[i] * d;
    // Corrections are made per length, that of a fortieth of the strand: finer segments correct less each. The same
    // corrections at each of many points would be chaotic, as differences of near points are mostly rounding.
    const lanes share = lower_of(40.0f * d * per_total, lanes(1.0f));
    const lanes advance = d + (clamped(rate * (d - 0.5f * share * lead), 0.25f * d, 1.25f * d) - d) * weight;
    ahead += advance;
    for (;;) {
      const auto is_past = above <= ahead && at < point_count - 2;
      if (!any_of(is_past)) break;
      low = chosen(is_past, high, low);
      below = is_past ? above : below;
      at = is_past ? at + 1 : at;
      read_rows(rows, at * 4 + 4, row);
      high = vector{row[0], row[1], row[2]} - root;
      above = row[3];
    }
    const lanes range = above - below;
    const auto has_range = range > 1.0e-12f;
    // Past the centre's tip straight on.
    const lanes part = has_range ? (ahead - below) / (has_range ? range : lanes(1.0f)) : lanes(0.0f);
    const vector middle = low + (high - low) * part;
    const lanes x = arc * per_total;
    lanes course = profile(x);
    // Where the strand is level with its progress along the centre: by its direction over about that length.
    own_run = own_run + (t[i] - own_run) * share;
    vector away = point - own_run * (arc - ahead) - middle;
    vector axis = axis_before;
    if (is_woven || twist != 0.0f) {
      // The centre's direction over about that length, which has no steps.
      run = run + (middle - middle_before - run) * share;
      axis = unit_or(run, lanes(1.0e-12f), axis_before);
      middle_before = middle;
    }
    if (twist != 0.0f) {
      // Rodrigues' rotation.
      lanes sine, cosine;
      sine_and_cosine(twist * course * base, sine, cosine);
      away = away * cosine + cross(axis, away) * sine + axis * (dot(axis, away) * (1.0f - cosine));
    }
    if (at_root > 0.0f) course = course - at_root * (1.0f - smoothstep(arc * per_root_distance));
    // No faster than the strand can follow, however steep the profile is.
    lanes pull = base * joined * course;
    const lanes change = pull - pull_before, way_square = dot(away, away) + 4.0f * width * width;
    const auto is_steep = change * change * way_square > d * d;
    if (any_of(is_steep)) {
      const lanes most_change = d / sqrt_of(is_steep ? way_square : lanes(1.0f));
      pull = is_steep ? pull_before + clamped(change, -most_change, most_change) : pull;
    }
    pull_before = pull;
    vector drawn = middle + away * (1.0f - pull * (1.0f - thickness));
    if (is_woven) {
      frame = turned(frame, axis_before, axis);
      lanes to_u, to_v;
      offset(ahead, pull, to_u, to_v);
      drawn = drawn + frame * to_u + cross(axis, frame) * to_v;
    }
    axis_before = axis;
    // Along the curve, and back onto it from beside it, the more the nearer to the centre it is drawn: by degrees where
    // that is far away.
    weight = pull * pull;
    const vector way_on = drawn - drawn_before;
    const lanes distance = sqrt_of(dot(way_on, way_on));
    const auto is_far = distance > 1.0e-3f * d;
    const vector forwards = way_on * (1.0f / (is_far ? distance : lanes(1.0f)));
    // A strand that is far from the curve keeps its direction to it, whichever way the curve goes.
    const lanes spacing = higher_of(0.025f * total, d);
    vector off = drawn_before - place;
    const lanes off_square = dot(off, off);
    const auto is_lost = off_square > spacing * spacing;
    if (any_of(is_lost)) off = off * (is_lost ? spacing / sqrt_of(is_lost ? off_square : lanes(1.0f)) : lanes(1.0f));
    const vector beside = off - forwards * dot(off, forwards);
    const lanes square = dot(beside, beside), most = 0.25f * spacing * spacing;
    const auto is_off = square > most;
    lanes back = 0.7f * share;
    if (any_of(is_off)) back *= is_off ? sqrt_of(most / (is_off ? square : lanes(1.0f))) : lanes(1.0f);
    t[i] = chosen(is_far, unit_or(way_on + beside * (back * weight), lanes(1.0e-18f), t[i]), t[i]);
    place = place + t[i] * d;
    drawn_before = drawn;
    // The strand's progress along the centre: as far as its length goes along the curve.
    const auto has_moved = distance > 0.5f * advance;
    const lanes rate_here = has_moved ? advance / (has_moved ? distance : lanes(1.0f)) : lanes(2.0f);
    rate += 0.5f * share * (lower_of(rate_here, lanes(1.25f)) - rate);
    lead = dot(drawn - place, forwards);
  }
};
