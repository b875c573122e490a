// SPDX-License-Identifier: GPL-3.0-or-later
//
// A strand beside the centre strand of its lock, for styles by which the strands of a lock are to move together.
//
// `lead` [m] is how far the strand is ahead along the centre of where it would be, had they begun together: what lies
// across the centre's line has one place along it. The frames of the strand turn to those of the centre, carried over
// by the least rotation between their directions. Both follow by degrees, over a part of the style's pitch; a strand
// that turns away from its centre goes on by itself, and so does one without a centre, or where centres have no points.
//
// keep_beside(progress, forward, t, u, v) is told how far along its path the strand is after a segment, the segment's
// share of that and its frame. in_centre_frame(u, v) turns an offset from the centre's frame into the strand's: the
// offset itself and not its differences, by which a turning frame would move the strand off its path.

const vector at_centre = reference(), u_first = first_frame(at_centre);
const float per_settling = 6.0f / number[9];
const bool is_beside = level >= 0 && first_centre < centre_points.shape[0];
lanes lead = 0.0f, turn_cosine = 1.0f, turn_sine = 0.0f;
const float* centre_rows[LANES];
ints centre_at = 0;
// The segment of the centre beside the strand: its frame and its end.
vector centre_axis, centre_frame, centre_end, beside_place = root;
lanes centre_arc = 0.0f;
const auto read_centre = [&](ints at, vector& point, lanes& arc) {
  lanes row[4];
  read_rows(centre_rows, at * 4, row);
  point = {row[0], row[1], row[2]};
  arc = row[3];
};
// The centre's frame in the strand's: cosine and sine of the angle between them.
const auto centre_angle = [&](const vector& forwards, const vector& u, const vector& v, lanes& cosine, lanes& sine) {
  const vector carried = turned(centre_frame, centre_axis, forwards);
  cosine = dot(carried, u);
  sine = dot(carried, v);
};
// Its direction from the end of the segment before; that one's where it has no length.
const auto read_segment = [&]() {
  const vector before = centre_end;
  const lanes arc_before = centre_arc;
  read_centre(centre_at + 1, centre_end, centre_arc);
  const lanes range = centre_arc - arc_before;
  const auto has_range = range > 1.0e-12f;
  return chosen(has_range, (centre_end - before) * (1.0f / (has_range ? range : lanes(1.0f))), centre_axis);
};
const auto turn_by = [&](lanes part, lanes cosine, lanes sine) {
  const lanes x = turn_cosine + (cosine - turn_cosine) * part, y = turn_sine + (sine - turn_sine) * part;
  const lanes size = sqrt_of(x * x + y * y);
  const auto is_long = size > 1.0e-3f;
  const lanes scale = 1.0f / (is_long ? size : lanes(1.0f));
  turn_cosine = is_long ? x * scale : turn_cosine;
  turn_sine = is_long ? y * scale : turn_sine;
};
if (is_beside) {
  for (int lane = 0; lane < LANES; ++lane) {
    centre_rows[lane] = reinterpret_cast<const float*>(centre_points.data) + size_t(centre[lane]) * point_count * 4;
  }
  read_centre(centre_at, centre_end, centre_arc);
  const vector from_centre = root - centre_end;
  centre_axis = centre_normal;
  centre_axis = read_segment();
  centre_frame = turned(at_centre, centre_normal, centre_axis);
  const lanes facing = in_lock * smoothstep(dot(t[1], centre_axis));
  lead = facing * dot(from_centre, centre_axis);
  lanes cosine, sine;
  centre_angle(t[1], u_first, cross(t[1], u_first), cosine, sine);
  turn_by(facing, cosine, sine);
}
const auto keep_beside = [&](
    lanes progress, lanes forward, const vector& forwards, const vector& u, const vector& v
) {
  beside_place = beside_place + forwards * forward;
  const lanes ahead = progress + lead;
  for (;;) {
    const auto is_past = centre_arc <= ahead && centre_at < point_count - 2;
    if (!any_of(is_past)) break;
    centre_at = is_past ? centre_at + 1 : centre_at;
    const vector axis = chosen(is_past, read_segment(), centre_axis);
    centre_frame = chosen(is_past, turned(centre_frame, centre_axis, axis), centre_frame);
    centre_axis = axis;
  }
  const lanes facing = in_lock * smoothstep(dot(forwards, centre_axis));
  const lanes part = facing * lower_of(forward * per_settling, lanes(0.45f));
  const lanes off = dot(beside_place - centre_end, centre_axis) + centre_arc - ahead;
  lead += clamped(part * off, -0.5f * forward, 0.5f * forward);
  lanes cosine, sine;
  centre_angle(forwards, u, v, cosine, sine);
  turn_by(part, cosine, sine);
};
const auto in_centre_frame = [&](lanes& u, lanes& v) {
  const lanes turned_u = u * turn_cosine - v * turn_sine;
  v = u * turn_sine + v * turn_cosine;
  u = turned_u;
};
