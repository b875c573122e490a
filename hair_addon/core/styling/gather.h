// SPDX-License-Identifier: GPL-3.0-or-later
//
// Strands that gather around their centre strand: they follow the curve of points q that are drawn to it, as far as
// their own length goes. So what is drawn onto the centre lies on it.
//
// offset(arc length of the centre, how far it is drawn, out u, out v) moves q in the centre's frames, if `is_woven`.

const auto gather = [&](float thickness, float twist, lanes joined, bool is_woven, auto offset) {
  const auto* centre_of = reinterpret_cast<const float*>(centre_points.data);
  marks at;
  vector low, high;
  lanes below, above;
  const auto take_place = [&](int lane) {
    const float* entry = centre_of + (size_t(centre[lane]) * point_count + at[lane]) * 4;
    set_lane(low.x, lane, entry[0]);
    set_lane(low.y, lane, entry[1]);
    set_lane(low.z, lane, entry[2]);
    set_lane(below, lane, entry[3]);
    set_lane(high.x, lane, entry[4]);
    set_lane(high.y, lane, entry[5]);
    set_lane(high.z, lane, entry[6]);
    set_lane(above, lane, entry[7]);
  };
  for (int lane = 0; lane < LANES; ++lane) {
    at[lane] = 0;
    take_place(lane);
  }
  // Roots stay: what the profile asks for at the root is reached over twice the distance to the centre.
  const vector root_away = root - low;
  const lanes root_distance = 2.0f * sqrt_of(dot(root_away, root_away));
  const auto is_apart = root_distance > 1.0e-9f;
  const lanes per_root_distance = is_apart ? 1.0f / (is_apart ? root_distance : lanes(1.0f)) : lanes(1.0e9f);
  vector point = root, place = root, drawn_before = root, middle_before = low;
  vector axis_before = centre_normal, frame = reference();
  lanes arc = 0.0f, ahead = 0.0f, rate = 1.0f, lead = 0.0f, weight = 0.0f;
  for (int i = 1; i < point_count; ++i) {
    const lanes d = length[i];
    arc += d;
    point = point + t[i] * d;
    const lanes advance = d + (clamped(rate * (d - lead), 0.25f * d, 2.0f * d) - d) * weight;
    ahead += advance;
    for (int lane = 0; lane < LANES; ++lane) {
      const float* arcs = centre_of + size_t(centre[lane]) * point_count * 4 + 3;
      const float wanted = get_lane(ahead, lane);
      while (at[lane] < point_count - 2 && arcs[4 * (at[lane] + 1)] <= wanted) ++at[lane];
      take_place(lane);
    }
    const lanes range = above - below;
    const auto has_range = range > 1.0e-12f;
    // Past the centre's tip straight on.
    const lanes part = has_range ? (ahead - below) / (has_range ? range : lanes(1.0f)) : lanes(0.0f);
    const vector middle = low + (high - low) * part;
    const lanes x = arc * per_total;
    lanes course = profile(x);
    vector away = point - t[i] * (arc - ahead) - middle;
    vector axis = axis_before;
    if (is_woven || twist != 0.0f) {
      // The centre's direction since the point before, which has no steps.
      axis = unit_or(middle - middle_before, lanes(1.0e-12f), axis_before);
      middle_before = middle;
    }
    if (twist != 0.0f) {
      // Rodrigues' rotation.
      lanes sine, cosine;
      sine_and_cosine(twist * course * base, sine, cosine);
      away = away * cosine + cross(axis, away) * sine + axis * (dot(axis, away) * (1.0f - cosine));
    }
    if (at_root > 0.0f) course = course - at_root * (1.0f - smoothstep(arc * per_root_distance));
    const lanes pull = base * joined * course;
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
    const vector off = drawn_before - place;
    const vector beside = off - forwards * dot(off, forwards);
    const lanes square = dot(beside, beside), most = 0.25f * d * d;
    const auto is_off = square > most;
    const lanes held = is_off ? sqrt_of(most / (is_off ? square : lanes(1.0f))) : lanes(1.0f);
    t[i] = chosen(is_far, unit_or(way_on + beside * (held * weight), lanes(1.0e-30f), t[i]), t[i]);
    place = place + t[i] * d;
    drawn_before = drawn;
    // The strand's progress along the centre: as far as its length goes along the curve.
    const auto has_moved = distance > 0.5f * advance;
    rate = has_moved ? advance / (has_moved ? distance : lanes(1.0f)) : lanes(2.0f);
    lead = dot(drawn - place, forwards);
  }
};
