// SPDX-License-Identifier: GPL-3.0-or-later
//
// Strands that gather around their centre strand: they follow the curve of points q that are drawn to it, as far as
// their own length goes. So what is drawn onto the centre lies on it.
//
// twist: turns about the centre at full strength; joined: 0 for strands that do not gather. Stands after
// centre_course.h.

const auto gather = [&](float thickness, float twist, lanes joined) {
  centre_course course;
  begin_course(course);
  // Roots stay: what the profile asks for at the root is reached over twice the distance to the centre.
  const lanes root_distance = 2.0f * sqrt_of(dot(course.low, course.low));
  const auto is_apart = root_distance > 1.0e-9f;
  const lanes per_root_distance = is_apart ? 1.0f / (is_apart ? root_distance : lanes(1.0f)) : lanes(1.0e9f);
  vector point = {}, place = {}, drawn_before = {}, middle_before = course.low;
  vector axis_before = centre_normal, run = {}, own_run = t[1];
  lanes arc = 0.0f, ahead = 0.0f, rate = 1.0f, lead = 0.0f, weight = 0.0f, pull_before = 0.0f;
  for (int i = 1; i < point_count; ++i) {
    const lanes d = length[i];
    arc += d;
    point = plus(point, t[i], d);
    // Corrections are made per length, that of a fortieth of the strand: finer segments correct less each. The same
    // corrections at each of many points would be chaotic, as differences of near points are mostly rounding.
    const lanes share = lower_of(40.0f * d * per_total, lanes(1.0f));
    const lanes advance = d + (clamped(rate * (d - 0.5f * share * lead), 0.25f * d, 1.25f * d) - d) * weight;
    ahead += advance;
    const vector middle = middle_at(course, ahead);
    const lanes x = arc * per_total;
    lanes wanted = profile(x);
    // Where the strand is level with its progress along the centre: by its direction over about that length.
    own_run = plus(own_run, t[i] - own_run, share);
    vector away = plus(point, own_run, ahead - arc) - middle;
    if (twist != 0.0f) {
      // The centre's direction over about that length, which has no steps.
      run = plus(run, middle - middle_before - run, share);
      const vector axis = unit_or(run, lanes(1.0e-12f), axis_before);
      middle_before = middle;
      axis_before = axis;
      // Rodrigues' rotation.
      lanes sine, cosine;
      sine_and_cosine(twist * wanted * base, sine, cosine);
      away = away * cosine + upward_of(axis, away) * sine + axis * (dot(axis, away) * (1.0f - cosine));
    }
    if (at_root > 0.0f) wanted = wanted - at_root * (1.0f - smoothstep(arc * per_root_distance));
    // No faster than the strand can follow, however steep the profile is.
    lanes pull = base * joined * wanted;
    const lanes change = pull - pull_before, way_square = dot(away, away);
    const auto is_steep = change * change * way_square > d * d;
    if (any_of(is_steep)) {
      const lanes most_change = d / sqrt_of(is_steep ? way_square : lanes(1.0f));
      pull = is_steep ? pull_before + clamped(change, -most_change, most_change) : pull;
    }
    pull_before = pull;
    const vector drawn = plus(middle, away, 1.0f - pull * (1.0f - thickness));
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
    const vector beside = plus(off, forwards, -dot(off, forwards));
    const lanes square = dot(beside, beside), most = 0.25f * spacing * spacing;
    const auto is_off = square > most;
    lanes back = 0.7f * share;
    if (any_of(is_off)) back *= is_off ? sqrt_of(most / (is_off ? square : lanes(1.0f))) : lanes(1.0f);
    t[i] = chosen(is_far, unit_or(plus(way_on, beside, back * weight), lanes(1.0e-18f), t[i]), t[i]);
    place = plus(place, t[i], d);
    drawn_before = drawn;
    // The strand's progress along the centre: as far as its length goes along the curve.
    const auto has_moved = distance > 0.5f * advance;
    const lanes rate_here = has_moved ? advance / (has_moved ? distance : lanes(1.0f)) : lanes(2.0f);
    rate += 0.5f * share * (lower_of(rate_here, lanes(1.25f)) - rate);
    lead = dot(drawn - place, forwards);
  }
};
