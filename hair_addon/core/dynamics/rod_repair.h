// SPDX-License-Identifier: GPL-3.0-or-later
//
// Points of the lanes that are `asked` in front of their planes, and segments as long as at rest, by turns: what the
// solve leaves of a strand that is folded against a surface. A lane whose lengths are right is not moved any more.
// Stands in rod_solver.cpp, before its use.

const auto repair = [&](ints asked) {
  ints moving = asked;
  const auto put_out = [&](int i) {
    const float* plane = plane_rows + size_t(8 * i) * STRIDE;
    const vector n = get_vector(plane, 0), point = get_vector(x, i);
    const lanes inside = get(plane, 3) - dot(n, point);
    put_vector(x, i, chosen(moving & (inside > 0.0f), point + n * inside, point));
  };
  ints is_off = 0;
  const auto set_length = [&](int i) {  // of the segment before point i
    const vector from = get_vector(x, i - 1), to = get_vector(x, i), along = to - from;
    const lanes size = exact_sqrt_of(dot(along, along));
    const lanes wanted = get(length, i - 1);
    is_off = is_off | (abs_of(size - wanted) > INSIDE * wanted);
    const vector change = along * ((wanted - size) / higher_of(size, wanted * 0.01f));
    if (i - 1 <= pinned) {
      put_vector(x, i, chosen(moving, to + change, to));
      return;
    }
    put_vector(x, i - 1, chosen(moving, from - change * lanes(0.5f), from));
    put_vector(x, i, chosen(moving, to + change * lanes(0.5f), to));
  };
  for (int sweep = 0; sweep < SWEEPS; ++sweep) {
    is_off = 0;
    for (int i = pinned + 1; i <= segment_count; ++i) {
      put_out(i);
      set_length(i);
    }
    for (int i = segment_count; i > pinned; --i) {
      put_out(i);
      set_length(i);
    }
    moving = moving & is_off;
    if (!any_of(moving)) break;
  }
  moving = asked;
  for (int i = pinned + 1; i <= segment_count; ++i) put_out(i);
};
