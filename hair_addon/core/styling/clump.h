// SPDX-License-Identifier: GPL-3.0-or-later
//
// Clump (clump.py): segments take the directions between points that are drawn to the centre strand.

const float thickness = number[8], twist = number[9], stray = number[10];
lanes joined = 1.0f;
if (stray > 0.0f) joined = clamped((random(STRAY) - stray) * 10.0f + 1.0f, lanes(0.0f), lanes(1.0f));
const auto* centre_of = reinterpret_cast<const float*>(centre_points.data);
marks at;
for (int lane = 0; lane < LANES; ++lane) at[lane] = 0;
vector point = root, drawn_before = root;
lanes arc = 0.0f;
for (int i = 1; i < point_count; ++i) {
  const lanes d = length[i];
  arc += d;
  point = point + t[i] * d;
  vector low, high;
  lanes below, above;
  for (int lane = 0; lane < LANES; ++lane) {
    const float* row = centre_of + size_t(centre[lane]) * point_count * 4;
    const float place = get_lane(arc, lane);
    while (at[lane] < point_count - 2 && row[4 * (at[lane] + 1) + 3] <= place) ++at[lane];
    const float* entry = row + 4 * at[lane];
    set_lane(low.x, lane, entry[0]);
    set_lane(low.y, lane, entry[1]);
    set_lane(low.z, lane, entry[2]);
    set_lane(below, lane, entry[3]);
    set_lane(high.x, lane, entry[4]);
    set_lane(high.y, lane, entry[5]);
    set_lane(high.z, lane, entry[6]);
    set_lane(above, lane, entry[7]);
  }
  const lanes range = above - below;
  const auto has_range = range > 1.0e-12f;
  // Past the centre's tip straight on.
  const lanes part = has_range ? (arc - below) / (has_range ? range : lanes(1.0f)) : lanes(0.0f);
  const vector way = high - low, middle = low + way * part;
  const lanes course = profile(arc * per_total);
  vector away = point - middle;
  if (twist != 0.0f) {
    // Rodrigues' rotation about the centre's direction.
    const vector axis = unit_or(way, lanes(1.0e-12f), t[i]);
    lanes sine, cosine;
    sine_and_cosine(twist * course * base, sine, cosine);
    away = away * cosine + cross(axis, away) * sine + axis * (dot(axis, away) * (1.0f - cosine));
  }
  const vector drawn = middle + away * (1.0f - base * joined * course * (1.0f - thickness));
  t[i] = unit_or(drawn - drawn_before, 1.0e-3f * d, t[i]);
  drawn_before = drawn;
}
