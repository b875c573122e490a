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
lanes lead = 0.0f;
const float* centre_rows[LANES];
ints centre_at = 0;
// What is known of the segment of the centre beside the strand, and of the strand, from one segment of it to the next:
// too much for the registers of a GPU.
enum { AXIS = 0, FRAME = 3, END = 6, PLACE = 9, ARC = 12, COSINE = 13, SINE = 14 };
static_assert(SINE < SPARES, "numbers of a strand beside its centre");
const auto kept = [&](int first) { return vector{spare[first], spare[first + 1], spare[first + 2]}; };
const auto store = [&](int first, const vector& value) {
  spare[first] = value.x;
  spare[first + 1] = value.y;
  spare[first + 2] = value.z;
};
// The direction of the segment that ends at point `centre_at` + 1; that of the one before where it has no length.
const auto read_segment = [&](const vector& axis_before) {
  const vector before = kept(END);
  const lanes arc_before = spare[ARC];
  lanes row[4];
  read_rows(centre_rows, centre_at * 4 + 4, row);
  const vector end = {row[0], row[1], row[2]};
  store(END, end);
  spare[ARC] = row[3];
  const lanes range = row[3] - arc_before;
  const auto has_range = range > 1.0e-12f;
  return chosen(has_range, (end - before) * (1.0f / (has_range ? range : lanes(1.0f))), axis_before);
};
// A part of the turn to the centre's frame, carried over to the strand's.
const auto turn_by = [&](lanes part, const vector& carried, const vector& u, const vector& v, lanes& x, lanes& y) {
  x += (dot(carried, u) - x) * part;
  y += (dot(carried, v) - y) * part;
  const lanes size = sqrt_of(x * x + y * y);
  const auto is_long = size > 1.0e-3f;
  const lanes scale = 1.0f / (is_long ? size : lanes(1.0f));
  spare[COSINE] = is_long ? x * scale : lanes(1.0f);
  spare[SINE] = is_long ? y * scale : lanes(0.0f);
};
if (is_beside) {
  for (int lane = 0; lane < LANES; ++lane) {
    centre_rows[lane] = reinterpret_cast<const float*>(centre_points.data) + size_t(centre[lane]) * point_count * 4;
  }
  lanes row[4];
  read_rows(centre_rows, centre_at * 4, row);
  const vector centre_root = {row[0], row[1], row[2]};
  store(END, centre_root);
  spare[ARC] = row[3];
  const vector axis = read_segment(centre_normal), frame = turned(at_centre, centre_normal, axis);
  store(AXIS, axis);
  store(FRAME, frame);
  store(PLACE, root);
  const lanes facing = in_lock * smoothstep(dot(t[1], axis));
  lead = facing * dot(root - centre_root, axis);
  lanes cosine = 1.0f, sine = 0.0f;
  turn_by(facing, turned(frame, axis, t[1]), u_first, cross(t[1], u_first), cosine, sine);
}
const auto keep_beside = [&](
    lanes progress, lanes forward, const vector& forwards, const vector& u, const vector& v
) {
  const lanes ahead = progress + lead;
  vector axis = kept(AXIS), frame = kept(FRAME);
  for (;;) {
    const auto is_past = lanes(spare[ARC]) <= ahead && centre_at < point_count - 2;
    if (!any_of(is_past)) break;
    centre_at = is_past ? centre_at + 1 : centre_at;
    const vector next_axis = chosen(is_past, read_segment(axis), axis);
    frame = chosen(is_past, turned(frame, axis, next_axis), frame);
    axis = next_axis;
  }
  store(AXIS, axis);
  store(FRAME, frame);
  const vector here = kept(PLACE) + forwards * forward;
  store(PLACE, here);
  const lanes facing = in_lock * smoothstep(dot(forwards, axis));
  const lanes part = facing * lower_of(forward * per_settling, lanes(0.45f));
  const lanes off = dot(here - kept(END), axis) + spare[ARC] - ahead;
  lead += clamped(part * off, -0.5f * forward, 0.5f * forward);
  lanes cosine = spare[COSINE], sine = spare[SINE];
  turn_by(part, turned(frame, axis, forwards), u, v, cosine, sine);
};
const auto in_centre_frame = [&](lanes& u, lanes& v) {
  const lanes cosine = spare[COSINE], sine = spare[SINE], turned_u = u * cosine - v * sine;
  v = u * sine + v * cosine;
  u = turned_u;
};
