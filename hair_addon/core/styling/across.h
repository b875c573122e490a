// SPDX-License-Identifier: GPL-3.0-or-later
//
// Points that a style moves across their strand: given ρ_i in the frames, of which differences alone count,
//
//   w_i = ρ_i - ρ_(i-1), held to 0.98 d_i;  e_i = sqrt(d_i² - |w_i|²);  o'_i = e_i t(a) + w_i,u u(a) + w_i,v v(a)
//
// where a is the strand's own progress Σ e_j, so it goes around the head where the strand did before, and every
// segment is as long as it was. With `keep_length` κ below 1 the progress is (1 - κ) d_i + κ e_i, and the strand
// becomes longer.
// offset(i, s, x, out u, out v) gives ρ_i [m] at the arc length s [m], x of the strand's length; u_first: the first
// segment's frame; passed(progress at the end of a segment, e, t, u, v) is called after each.

const auto move_across = [&](auto offset, lanes before_u, lanes before_v, const vector& u_first, auto passed) {
  const float keep_length = number[7];
  // The segments around each lane's progress, which are kept while it stays between their middles: there their frames
  // hold. `end` is the arc length at the end of the second.
  const int ahead = point_count > 2 ? 2 : 1;
  ints at = 1;
  lanes below = 0.5f * length[1], above = below, end = length[1];
  vector t_below = t[1], u_below = u_first, t_above = t_below, u_above = u_below;
  if (ahead > 1) {
    above = end + 0.5f * length[ahead];
    end += length[ahead];
    t_above = t[ahead];
    u_above = turned(u_below, t_below, t_above);
  }
  lanes progress = 0.0f, arc = 0.0f;
  for (int i = 1; i < point_count; ++i) {
    const lanes d = length[i];
    arc += d;
    lanes to_u, to_v;
    offset(i, arc, arc * per_total, to_u, to_v);
    lanes w_u = to_u - before_u, w_v = to_v - before_v;
    before_u = to_u;
    before_v = to_v;
    const lanes square = fused(w_u, w_u, w_v * w_v), most = 0.9604f * d * d;
    const auto is_far = square > most;
    if (any_of(is_far)) {
      const lanes held = is_far ? sqrt_of(most / (is_far ? square : lanes(1.0f))) : lanes(1.0f);
      w_u *= held;
      w_v *= held;
    }
    lanes forward = sqrt_of(higher_of(fused(d, d, -fused(w_u, w_u, w_v * w_v)), lanes(0.0f)));
    lanes size = d;
    if (keep_length != 1.0f) {
      forward = (1.0f - keep_length) * d + keep_length * forward;
      size = sqrt_of(forward * forward + w_u * w_u + w_v * w_v);
    }
    const lanes middle = progress + 0.5f * forward;
    progress += forward;
    // The frame at `middle`, between those of the segments around it.
    for (;;) {
      const auto is_past = above <= middle && at < point_count - 2;
      if (!any_of(is_past)) break;
      below = is_past ? above : below;
      t_below = chosen(is_past, t_above, t_below);
      u_below = chosen(is_past, u_above, u_below);
      at = is_past ? at + 1 : at;
      lanes size_above = 0.0f;
      const int last = most_of(is_past ? at : ints(0));
      for (int i_at = least_of(is_past ? at : ints(MOST)); i_at <= last; ++i_at) {
        const auto is_here = is_past && at == i_at;
        size_above = is_here ? length[i_at + 1] : size_above;
        t_above = chosen(is_here, t[i_at + 1], t_above);
      }
      above = is_past ? end + 0.5f * size_above : above;
      end += size_above;
      u_above = chosen(is_past, turned(u_below, t_below, t_above), u_above);
    }
    const lanes range = above - below;
    const auto is_between = range > 1.0e-12f;
    const lanes part = clamped(
        is_between ? (middle - below) / (is_between ? range : lanes(1.0f)) : lanes(0.0f), lanes(0.0f), lanes(1.0f)
    );
    vector t_between = plus(t_below, t_above - t_below, part);
    vector u_between = plus(u_below, u_above - u_below, part);
    // Opposite directions cancel each other: from a right angle on the frame halfway takes part.
    const lanes facing = dot(t_below, t_above);
    if (any_of(facing < 0.0f)) {
      const lanes bulge = higher_of(-facing, lanes(0.0f)) * 4.0f * part * (1.0f - part);
      const auto has_middle = facing > 1.0e-6f - 1.0f;
      const vector half = unit_or(
          chosen(has_middle, t_below + t_above, upward_of(t_below, u_below)), lanes(1.0e-6f), t_below
      );
      t_between = t_between + half * bulge;
      u_between = u_between + turned(u_below, t_below, half) * bulge;
    }
    const vector forwards = unit_or(t_between, lanes(1.0e-6f), t_below);
    const vector sideways = unit_or(plus(u_between, forwards, -dot(u_between, forwards)), lanes(1.0e-6f), u_below);
    const vector upward = upward_of(forwards, sideways);
    const vector made = plus(plus(forwards * forward, sideways, w_u), upward, w_v);
    const auto has_length = d > 1.0e-12f;
    const vector nearly = made * (1.0f / (has_length ? size : lanes(1.0f)));
    // Unit but for rounding, which a step of Newton's method takes away.
    const vector direction = nearly * fused(lanes(-0.5f), dot(nearly, nearly), lanes(1.5f));
    next[i] = any_of(!has_length) ? chosen(has_length, direction, t[i]) : direction;
    if (keep_length != 1.0f) next_length[i] = has_length ? size : d;
    passed(progress, forward, forwards, sideways, upward);
  }
  swap(t, next);
  if (keep_length != 1.0f) {
    swap(length, next_length);
    put_total();
  }
};
