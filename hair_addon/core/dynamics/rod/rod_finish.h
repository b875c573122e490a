// SPDX-License-Identifier: GPL-3.0-or-later
//
// End of a substep: moves out points that are still inside, computes velocities, resets broken strands to their groom.

lanes stretch = 0.0f, reach = 0.0f, whole = 0.0f;
ints is_sound = -1;
const float per_step = 1.0f / h;
const bool has_found = around.found_planes.shape[0] > 0;
ints is_pinched = 0;  // lanes that cannot be outside at their length: they keep it, and come out later
if (has_planes && has_found) {
  // Inside a plane even after AGAIN: between two planes, of which each solve used one.
  ints is_inside = 0;
  for (int i = pinned + 1; i <= segment_count; ++i) {
    const float* const found = found_rows + size_t(8 * i) * STRIDE;
    const lanes inside = get(found, 3) - dot(get_vector(found, 0), get_vector(x, i));
    is_inside = is_inside | (is_free(i) & (inside > INSIDE * get(length, i - 1)));
  }
  if (any_of(is_inside)) {
    is_pinched = repair(is_inside, plane_rows, found_rows);
    bound_lengths(is_pinched);
  }
}
const float* const last_plane_rows = has_found ? found_rows : plane_rows;
vector last = get_vector(x, 0);
for (int i = 0; i <= segment_count; ++i) {
  if (i < segment_count) {
    fetch(x, 3 * (i + 1), 3);
    fetch(x_before, 3 * (i + 1), 3);
    fetch(length, i, 1);
  }
  vector point = get_vector(x, i);
  if (has_planes && i > pinned) {
    const float* plane = last_plane_rows + size_t(8 * i) * STRIDE;
    const vector n = get_vector(plane, 0);
    const lanes inside = dot(n, point) - get(plane, 3);
    point = chosen((inside < 0.0f) & (is_pinched == 0) & is_free(i), point - n * inside, point);
    put_vector(x, i, point);
  }
  // Divided by h: the rounding error of h · (1 / h) would grow with each substep.
  const vector moved = point - get_vector(x_before, i);
  put_vector(v, i, vector{moved.x / lanes(h), moved.y / lanes(h), moved.z / lanes(h)});
  if (i > 0) {
    const vector segment = point - last, from_root = point - root;
    const lanes size = get(length, i - 1);
    stretch = higher_of(dot(segment, segment) / (size * size), stretch);
    reach = higher_of(dot(from_root, from_root), reach);
    whole += size;
    is_sound = is_sound & (dot(point, point) < 1.0e30f);  // false for NaN
  }
  last = point;
}
for (int j = 0; j < segment_count; ++j) {
  if (j + 1 < segment_count) {
    fetch(q, 4 * (j + 1), 4);
    fetch(q_before, 4 * (j + 1), 4);
  }
  const quaternion frame = get_frame(q, j);
  const quaternion turn = times(frame, conjugate(get_frame(q_before, j)));
  // Bounded for rotations near 180°.
  const lanes scale = 2.0f * per_step * turn.w / higher_of(turn.w * turn.w, lanes(0.01f));
  put_vector(spin, j, vector{turn.x * scale, turn.y * scale, turn.z * scale});
  is_sound = is_sound & (dot(vector{frame.x, frame.y, frame.z}, vector{frame.x, frame.y, frame.z}) < 2.0f);
}
const lanes most_reach = whole * (1.25f * most_stretch);  // 1.5 lengths for the default of 1.2
is_sound = is_sound & (stretch < most_stretch * most_stretch) & (reach < most_reach * most_reach);
if (any_of(is_sound == 0)) {
  for (int i = 0; i <= segment_count; ++i) {
    const vector shape = get_vector(groom, i);
    const vector goal = root + rotated(root_frame, shape), goal_before = root_before + rotated(frame_before, shape);
    put_vector(x, i, chosen(is_sound, get_vector(x, i), goal));
    put_vector(v, i, chosen(is_sound, get_vector(v, i), (goal - goal_before) * lanes(per_step)));
    put(slip, i, is_sound ? get(slip, i) : lanes(-1.0f));
  }
  const vector none{lanes(0.0f), lanes(0.0f), lanes(0.0f)};
  for (int j = 0; j < segment_count; ++j) {
    put_frame(q, j, chosen_rotation(is_sound, get_frame(q, j), times(root_frame, get_frame(groom_frame, j))));
    put_vector(spin, j, chosen(is_sound, get_vector(spin, j), none));
    put_vector(lambda, 2 * j, chosen(is_sound, get_vector(lambda, 2 * j), none));
    put_vector(lambda, 2 * j + 1, chosen(is_sound, get_vector(lambda, 2 * j + 1), none));
  }
  put(resets, 0, get(resets, 0) + (is_sound ? lanes(0.0f) : lanes(1.0f)));
}
