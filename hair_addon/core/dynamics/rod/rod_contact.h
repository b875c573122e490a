// SPDX-License-Identifier: GPL-3.0-or-later
//
// Contact as a function of the rod's pull: Coulomb's law in planes, evaluated between Newton's solves.
//
// A plane has its unit normal n, offset n·c + r, displacement s in this substep and friction μ. With x̃ the predicted
// point, U the displacement that λ gives it without contact, T = 1 - n nᵀ and g = n·x̃ - offset:
//
//     p = -(g + n·U)                          displacement by contact; active where p > 0
//     t = |T (x - x_before - s)|              sliding distance of the last pass
//     a = 1 / (1 + μ p / max(t, CREEP h))     Coulomb: slides under μ p, creeps where it sticks
//     x = x̃ - g n - (1 - a) T (x̃ - x_before - s) + F U - w n nᵀ U',   F = w n nᵀ + a T;   x̃ + U if not active
//
// F filters masses in the solve [Baraff98]. x is a function of λ and the contact state, which passes may therefore
// change freely. w is `away_of` the point, and U' is U at the beginning of the pass; this term cancels the penetration
// that w would allow under the rod's pull. In the first pass U is that of the last substep, which determines the active
// points. There t is given by Coulomb's law, |T (x̃ + U - x_before - s)| - μ p, for points with little pull by the rod.
// For points that are dragged by the rod t is the last sliding distance, because the pull depends so strongly on a that
// the law would overshoot.

struct touch {
  vector n, point;
  lanes a;
  ints is_pressed;
};
const auto touch_at = [&](int i, bool is_first, float carried) {
  const float* plane = plane_rows + size_t(8 * i) * STRIDE;
  const vector n = get_vector(plane, 0), slide = get_vector(plane + 4 * STRIDE, 0);
  const vector predicted = get_vector(contact(i) + 4 * STRIDE, 0);
  vector pull = get_vector(lambda, 2 * i - 1) * (1.0f / get(length, i - 1));
  if (i < segment_count) pull = pull - get_vector(lambda, 2 * i + 1) * (1.0f / get(length, i));
  pull = pull * (get(mobility, i) * carried);
  const auto across = [&](const vector& v) { return v - n * dot(n, v); };
  const auto size_of = [&](const vector& v) { return exact_sqrt_of(dot(v, v)); };
  const lanes friction = get(plane, 7);
  const lanes gap = dot(n, predicted) - get(plane, 3);
  const lanes push = -(gap + dot(n, pull));
  const vector moved_before = get_vector(x_before, i) + slide;
  const vector free_slide = across(predicted - moved_before);
  lanes away = lanes(0.0f);
  lanes sliding = size_of(across(get_vector(x, i) - moved_before));
  if (is_first) {
    const lanes last = get(slip, i);
    const lanes dragged = last < 0.0f ? size_of(free_slide) : last * exact_sqrt_of(lanes(carried));
    const lanes alone = higher_of(size_of(across(predicted + pull - moved_before)) - friction * push, lanes(0.0f));
    const lanes own = dot(free_slide, free_slide), of_rod = dot(pull, pull);
    const lanes share = own / (own + ROD_SHARE * of_rod + 1.0e-30f);
    sliding = dragged + (alone - dragged) * share;
    away = -get(contact(i), 7) * dot(n, pull);
    pull = vector{lanes(0.0f), lanes(0.0f), lanes(0.0f)};
  }
  const auto is_pressed = (dot(n, n) > 0.5f) & (push > 0.0f);
  const lanes loose = 1.0f / (1.0f + friction * higher_of(push, lanes(0.0f)) / higher_of(sliding, lanes(CREEP * h)));
  const lanes a = is_pressed ? loose : lanes(1.0f);
  const vector pressed = predicted - n * gap - free_slide * (1.0f - a) + across(pull) * a + n * away;
  return touch{chosen(is_pressed, n, vector{lanes(0.0f), lanes(0.0f), lanes(0.0f)}),
               chosen(is_pressed, pressed, predicted + pull), a, is_pressed};
};
// Lanes whose contacts differ from those of the last solve.
const auto changed_contacts = [&](ints asked) {
  ints is_changed = 0;
  for (int i = pinned + 1; i <= segment_count; ++i) {
    const touch now = touch_at(i, false, 1.0f);
    const vector n = get_vector(contact(i), 0);
    const lanes a = get(contact(i), 3);
    const ints was_pressed = dot(n, n) > 0.5f;
    is_changed = is_changed | (is_free(i) & ((was_pressed != now.is_pressed) | (abs_of(now.a - a) > CHANGE * a)));
  }
  return ints(asked & is_changed);
};
// Updates the contacts and points of some lanes from λ.
const auto put_contacts = [&](bool is_first, float carried, ints lanes_asked) {
  for (int i = pinned + 1; i <= segment_count; ++i) {
    const ints asked = lanes_asked & is_free(i);
    const touch now = touch_at(i, is_first, carried);
    const vector n = get_vector(contact(i), 0);
    const vector put_n = chosen(asked, now.n, n);
    put(contact(i), 0, put_n.x);
    put(contact(i), 1, put_n.y);
    put(contact(i), 2, put_n.z);
    put(contact(i), 3, asked ? now.a : get(contact(i), 3));
    put_vector(x, i, chosen(asked, now.point, get_vector(x, i)));
  }
};
