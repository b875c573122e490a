// SPDX-License-Identifier: GPL-3.0-or-later
//
// A strand beside the centre strand of its lock, for styles by which the strands of a lock are to move together.
//
// `lead` [m] is how far the strand is ahead along the centre of where it would be, had they begun together: what lies
// across the centre's line has one place along it. The frames of the strand turn to those of the centre, carried over
// by the least rotation between their directions. The centre's direction and frame turn from the middle of each segment
// to that of the next: in steps, rounding would decide beside which of two a strand is. Both follow by degrees, over a
// part of the style's pitch; a strand that turns away from its centre goes on by itself, and so does one without a
// centre, or where centres have no points.
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
// What is known of the centre and of the strand, from one segment of it to the next: too much for a GPU's registers.
// SEGMENT [m] begins at point `centre_at`, where the arc length is ARC and from where AWAY leads to the strand's place;
// SEGMENT_BELOW ends there, with the frame FRAME.
enum { SEGMENT = 0, SEGMENT_BELOW = 3, FRAME = 6, AWAY = 9, ARC = 12, COSINE = 13, SINE = 14 };
static_assert(SINE < SPARES, "numbers of a strand beside its centre");
const auto kept = [&](int first) { return vector{spare[first], spare[first + 1], spare[first + 2]}; };
const auto store = [&](int first, const vector& value) {
  spare[first] = value.x;
  spare[first + 1] = value.y;
  spare[first + 2] = value.z;
};
// The segment that begins at point `centre_at`; one without length has a nanometre in the direction of the one before.
const auto read_segment = [&](const vector& axis_before, lanes& arc) {
  lanes start[4], end[4];
  read_rows(centre_rows, centre_at * 4, start);
  read_rows(centre_rows, centre_at * 4 + 4, end);
  arc = start[3];
  const auto has_range = end[3] - start[3] > 1.0e-12f;
  return chosen(has_range, {end[0] - start[0], end[1] - start[1], end[2] - start[2]}, axis_before * lanes(1.0e-9f));
};
const auto size_of = [&](const vector& segment) { return sqrt_of(dot(segment, segment)); };
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
  const vector away = root - vector{row[0], row[1], row[2]};
  const vector segment = read_segment(centre_normal, row[3]), axis = segment * (1.0f / size_of(segment));
  const vector frame = turned(at_centre, centre_normal, axis);
  store(SEGMENT, segment);
  store(SEGMENT_BELOW, segment);
  store(FRAME, frame);
  store(AWAY, away);
  spare[ARC] = row[3];
  const lanes facing = in_lock * smoothstep(dot(t[1], axis));
  lead = facing * dot(away, axis);
  lanes cosine = 1.0f, sine = 0.0f;
  turn_by(facing, turned(frame, axis, t[1]), u_first, upward_of(t[1], u_first), cosine, sine);
}
const auto keep_beside = [&](
    lanes progress, lanes forward, const vector& forwards, const vector& u, const vector& v
) {
  const lanes ahead = progress + lead;
  vector segment = kept(SEGMENT), segment_below = kept(SEGMENT_BELOW), frame_below = kept(FRAME);
  vector away = plus(kept(AWAY), forwards, forward);
  lanes size = size_of(segment), size_below = size_of(segment_below), arc = spare[ARC];
  vector axis_above = segment * (1.0f / size), axis_below = segment_below * (1.0f / size_below);
  for (;;) {
    const auto is_past = arc + 0.5f * size <= ahead && centre_at < point_count - 2;
    if (!any_of(is_past)) break;
    centre_at = is_past ? centre_at + 1 : centre_at;
    frame_below = chosen(is_past, turned(frame_below, axis_below, axis_above), frame_below);
    axis_below = chosen(is_past, axis_above, axis_below);
    segment_below = chosen(is_past, segment, segment_below);
    size_below = is_past ? size : size_below;
    away = chosen(is_past, away - segment, away);
    lanes arc_read;
    segment = chosen(is_past, read_segment(axis_above, arc_read), segment);
    arc = is_past ? arc_read : arc;
    size = size_of(segment);
    axis_above = segment * (1.0f / size);
  }
  store(SEGMENT, segment);
  store(SEGMENT_BELOW, segment_below);
  store(FRAME, frame_below);
  store(AWAY, away);
  spare[ARC] = arc;
  const lanes between = clamped(
      (ahead - arc + 0.5f * size_below) / (0.5f * (size_below + size)), lanes(0.0f), lanes(1.0f)
  );
  const vector axis = unit_or(plus(axis_below, axis_above - axis_below, between), lanes(1.0e-6f), axis_below);
  const vector frame = turned(frame_below, axis_below, axis);
  const lanes facing = in_lock * smoothstep(dot(forwards, axis));
  const lanes part = facing * lower_of(forward * per_settling, lanes(0.45f));
  const lanes off = dot(away, axis) + arc - ahead;
  lead += clamped(part * off, -0.5f * forward, 0.5f * forward);
  lanes cosine = spare[COSINE], sine = spare[SINE];
  turn_by(part, turned(frame, axis, forwards), u, v, cosine, sine);
};
const auto in_centre_frame = [&](lanes& u, lanes& v) {
  const lanes cosine = spare[COSINE], sine = spare[SINE], turned_u = u * cosine - v * sine;
  v = u * sine + v * cosine;
  u = turned_u;
};
