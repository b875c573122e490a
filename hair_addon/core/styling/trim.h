// SPDX-License-Identifier: GPL-3.0-or-later
//
// Trim (trim.py): strands become shorter or longer, cut along themselves or scaled.

const float factor = number[8], random_part = number[9], to_length = number[10];
const float undercoat = number[11], undercoat_length = number[12];
const bool is_cut = number[13] != 0.0f, has_plane = number[14] != 0.0f;
// Strands with the lowest numbers are the undercoat, by degrees: so the part may be a slider.
const lanes coat = clamped((undercoat * 1.05f - random(UNDERCOAT)) * 20.0f, lanes(0.0f), lanes(1.0f));
lanes wanted = lower_of(total * factor * (1.0f - random_part * random(LENGTH)), lanes(to_length));
wanted *= 1.0f + (undercoat_length - 1.0f) * coat;
put_points();
const vector axis = {number[15], number[16], number[17]};
const lanes plane = number[18] - dot(root, axis);
lanes is_at_plane = 0.0f;
if (has_plane) {
  // The first point that lies on the far side, and where its segment crosses the plane.
  lanes before = -plane;
  lanes crossing = before > 0.0f ? lanes(0.0f) : lanes(3.0e38f);
  for (int i = 1; i < point_count; ++i) {
    const lanes beyond = dot(place[i], axis) - plane;
    const auto is_crossing = beyond > 0.0f && before <= 0.0f && crossing > 1.0e38f;
    const lanes step_size = is_crossing ? beyond - before : lanes(1.0f);
    crossing = is_crossing ? along[i - 1] - length[i] * before / step_size : crossing;
    before = beyond;
  }
  is_at_plane = crossing < wanted && crossing > 0.0f && base == 1.0f ? lanes(1.0f) : lanes(0.0f);
  wanted = lower_of(wanted, crossing);
}
wanted = total + base * (wanted - total);
if (is_cut) {
  const auto is_kept = abs_of(wanted * per_total - 1.0f) < 1.0e-7f;
  lanes* const length_made = next_length;
  lanes exact;
  // The curve through the points is not where the points' segments are: its tip is brought back to the plane.
  for (int pass = 0; pass < (has_plane ? 3 : 1); ++pass) {
    const lanes scale = wanted * per_total;
    marks at;
    for (int lane = 0; lane < LANES; ++lane) at[lane] = 0;
    lanes sum = 0.0f;
    vector before = {}, direction = t[1];
    for (int i = 1; i < point_count; ++i) {
      const lanes reached = along[i] * scale;
      lanes below, above;
      for (int lane = 0; lane < LANES; ++lane) {
        const float arc = get_lane(reached, lane);
        while (at[lane] < point_count - 2 && lane_of(along[at[lane] + 1], lane) < arc) ++at[lane];
        set_lane(below, lane, lane_of(along[at[lane]], lane));
        set_lane(above, lane, lane_of(along[at[lane] + 1], lane));
      }
      const lanes range = above - below;
      const auto has_range = range > 1.0e-12f;
      const lanes f = clamped(
          has_range ? (reached - below) / (has_range ? range : lanes(1.0f)) : lanes(0.0f), lanes(0.0f), lanes(1.0f)
      );
      // A cubic through the points around [Catmull74], and straight on past the tip.
      marks back, beyond;
      lanes is_first, is_last;
      for (int lane = 0; lane < LANES; ++lane) {
        back[lane] = at[lane] > 0 ? at[lane] - 1 : 0;
        beyond[lane] = at[lane] < point_count - 2 ? at[lane] + 2 : point_count - 1;
        set_lane(is_first, lane, at[lane] > 0 ? 0.0f : 1.0f);
        set_lane(is_last, lane, at[lane] < point_count - 2 ? 0.0f : 1.0f);
      }
      const vector p1 = gathered(place, at, 0), p2 = gathered(place, at, 1);
      const vector p0 = chosen(is_first > 0.0f, p1 * 2.0f - p2, gathered(place, back, 0));
      const vector p3 = chosen(is_last > 0.0f, p2 * 2.0f - p1, gathered(place, beyond, 0));
      const vector bend = p0 * 2.0f - p1 * 5.0f + p2 * 4.0f - p3;
      const vector twist = (p1 - p2) * 3.0f + p3 - p0;
      vector point = p1 + ((p2 - p0) + (bend + twist * f) * f) * (0.5f * f);
      point = point + t[point_count - 1] * higher_of(reached - total, lanes(0.0f));
      const vector segment = point - before;
      const lanes size = sqrt_of(dot(segment, segment));
      direction = unit_or(segment, lanes(1.0e-12f), direction);
      next[i] = direction;
      before = point;
      length_made[i] = size;
      sum += size;
    }
    exact = wanted / higher_of(sum, lanes(1.0e-20f));
    if (has_plane) {
      vector tip = {};
      for (int i = 1; i < point_count; ++i) tip = tip + next[i] * (length_made[i] * exact);
      const lanes slope = higher_of(dot(direction, axis), lanes(0.1f));
      wanted -= is_at_plane * (dot(tip, axis) - plane) / slope;
      wanted = higher_of(wanted, lanes(0.0f));
    }
  }
  for (int i = 1; i < point_count; ++i) {
    t[i] = chosen(is_kept, t[i], next[i]);
    length[i] = is_kept ? length[i] : length_made[i] * exact;
  }
} else {
  for (int i = 1; i < point_count; ++i) length[i] *= wanted * per_total;
}
put_total();
