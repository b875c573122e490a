// SPDX-License-Identifier: GPL-3.0-or-later
//
// Start of a substep: predicts points by gravity, air and hold, without the rod's forces, and frames by their spin.
//
// Air drag and hold are implicit. Both add to a point's mass: m' = m (1 + h c + h² k + 2 h √k), with the rate of drag c
// [1/s] and the strength of hold k [1/s²]. An equilibrium therefore does not depend on h: all forces on a point at rest
// are divided by the same m'. The difference of drag along and across the strand is explicit.

for (int i = 0; i <= segment_count; ++i) {
  if (i < segment_count) {
    fetch(x, 3 * (i + 1), 3);
    fetch(v, 3 * (i + 1), 3);
    fetch(q, 4 * i, 4);
    fetch(inverse_mass, i + 1, 1);
  }
  const vector point = get_vector(x, i);
  put_vector(x_before, i, point);
  if (i <= pinned) {
    put_vector(x, i, root + rotated(root_frame, get_vector(groom, i)));
    put(mobility, i, lanes(0.0f));
    continue;
  }
  const vector velocity = get_vector(v, i);
  const vector along = direction_of(get_frame(q, i - 1));
  const vector wind = has_air ? get_vector(air_rows, i) : vector{lanes(0.0f), lanes(0.0f), lanes(0.0f)};
  const vector relative = velocity - wind;
  const lanes along_speed = dot(relative, along);
  const vector across = relative - along * along_speed;
  const lanes speed = exact_sqrt_of(dot(across, across));
  lanes rate = higher_of(slow_drag, drag_square * speed + drag_root * cube_root(speed));
  if (has_drag) rate *= get(drag_rows, i);
  vector force{lanes(gravity[0]), lanes(gravity[1]), lanes(gravity[2])};
  if (has_acceleration) force = force + get_vector(acceleration_rows, i);
  force = force + wind * rate + along * ((1.0f - DRAG_ALONG) * rate * along_speed);
  lanes added = h * rate;
  vector step = velocity * lanes(h);
  if (has_hold) {
    const float along_part = static_cast<float>(i) / static_cast<float>(segment_count);
    const lanes strength = hold * (1.0f + (hold_tip - 1.0f) * along_part);
    const lanes critical = 2.0f * h * exact_sqrt_of(strength);
    const vector shape = get_vector(groom, i);
    const vector goal = root + rotated(root_frame, shape), goal_before = root_before + rotated(frame_before, shape);
    force = force + (goal - point) * strength;
    step = step + (goal - goal_before) * critical;
    added += h * h * strength + critical;
  }
  const lanes share = 1.0f / (1.0f + added);
  const auto is_held = pins >= lanes(static_cast<float>(i));
  put_vector(x, i, point + (step + force * lanes(h * h)) * share);
  put(mobility, i, is_held ? lanes(0.0f) : get(inverse_mass, i) * share);
  if (any_of(is_held)) {
    put_vector(x, i, chosen(is_held, root + rotated(root_frame, get_vector(groom, i)), get_vector(x, i)));
  }
}
for (int j = 0; j < segment_count; ++j) {
  if (j + 1 < segment_count) {
    fetch(q, 4 * (j + 1), 4);
    fetch(spin, 3 * (j + 1), 3);
  }
  const quaternion frame = get_frame(q, j);
  put_frame(q_before, j, frame);
  const vector turn = get_vector(spin, j) * lanes(h);
  put_frame(q, j, j < pinned ? times(root_frame, get_frame(groom_frame, j)) : turned_by(turn, frame));
  const auto is_held = pins > lanes(static_cast<float>(j));
  if (any_of(is_held)) {
    put_frame(q, j, chosen_rotation(is_held, times(root_frame, get_frame(groom_frame, j)), get_frame(q, j)));
  }
}
