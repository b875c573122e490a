// SPDX-License-Identifier: GPL-3.0-or-later
//
// Alternately moves points of the `asked` lanes in front of their planes and restores the lengths of segments, for
// strands that are still folded against a surface after the solve. A lane with correct lengths is finished. In a notch
// a point has a second plane in `others`, and is kept in front of both. Returns the lanes whose lengths are still
// wrong. Included in rod_solver.cpp before its use.

const auto repair = [&](ints asked, const float* planes, const float* others) {
  ints moving = asked;
  const auto put_out = [&](int i) {
    const float *one = planes + size_t(8 * i) * STRIDE, *other = others + size_t(8 * i) * STRIDE;
    const vector n = get_vector(one, 0), m = get_vector(other, 0), point = get_vector(x, i);
    const lanes inside = get(one, 3) - dot(n, point), inside_other = get(other, 3) - dot(m, point);
    // The closest place in front of one plane, of the other, or of both: on their line of intersection.
    const lanes along = dot(n, m), apart = 1.0f - along * along;
    const auto is_in = (inside > 0.0f) & (inside >= inside_other), is_in_other = (inside_other > 0.0f) & ~is_in;
    const auto is_both = (apart > LEAST_ANGLE) &
                         ((is_in & (inside_other > along * inside)) | (is_in_other & (inside > along * inside_other)));
    const lanes none = lanes(0.0f), alone = is_in ? inside : none, alone_other = is_in_other ? inside_other : none;
    const lanes by = is_both ? (inside - along * inside_other) / apart : alone;
    const lanes by_other = is_both ? (inside_other - along * inside) / apart : alone_other;
    put_vector(x, i, chosen(moving & (is_in | is_in_other) & is_free(i), point + n * by + m * by_other, point));
  };
  ints is_off = 0;
  const auto set_length = [&](int i) {  // of the segment before point i
    const vector from = get_vector(x, i - 1), to = get_vector(x, i), along = to - from;
    const lanes size = exact_sqrt_of(dot(along, along));
    const lanes wanted = get(length, i - 1);
    is_off = is_off | (is_free(i) & (abs_of(size - wanted) > INSIDE * wanted));
    const vector change = along * ((wanted - size) / higher_of(size, wanted * 0.01f));
    if (i - 1 <= pinned) {
      put_vector(x, i, chosen(moving & is_free(i), to + change, to));
      return;
    }
    const lanes share = is_free(i - 1) ? lanes(0.5f) : lanes(1.0f);
    put_vector(x, i - 1, chosen(moving & is_free(i - 1), from - change * lanes(0.5f), from));
    put_vector(x, i, chosen(moving & is_free(i), to + change * share, to));
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
  const ints pinched = moving;
  moving = asked;
  for (int i = pinned + 1; i <= segment_count; ++i) put_out(i);
  return pinched;
};
// Limits the strain of segments of some lanes to ± PINCHED, from root to tip.
const auto bound_lengths = [&](ints asked) {
  if (!any_of(asked)) return;
  for (int i = pinned + 1; i <= segment_count; ++i) {
    const vector from = get_vector(x, i - 1), to = get_vector(x, i), along = to - from;
    const lanes size = exact_sqrt_of(dot(along, along)), wanted = get(length, i - 1);
    const lanes bounded = clamped(size, wanted * (1.0f - PINCHED), wanted * (1.0f + PINCHED));
    const vector reached = from + along * (bounded / higher_of(size, wanted * 0.01f));
    put_vector(x, i, chosen(asked & (bounded != size) & is_free(i), reached, to));
  }
};
