// SPDX-License-Identifier: GPL-3.0-or-later
//
// Tresses of a braid or a rope (braid.py) around the centre of a lock. Stands after centre_course.h.
//
// How far along the centre each point of a strand is follows from its arc length alone. As far as the strand's own
// length goes, it would change with every swing of the hair, as roots of a lock stand still beside each other, and the
// strand would slide along its tress. What is missing or too much stretches the strand where it gathers.

const float radius = number[8], pitch = number[9], flat = number[10], thickness = number[12];
const int tress_count = static_cast<int>(number[11]);
const float most_stretch = 1.5f;
centre_course course;
begin_course(course);
// The tress of a strand: by the angle about the lock's centre at which it is rooted.
const vector at_centre = reference();
const lanes right = -dot(course.low, at_centre), up = -dot(course.low, upward_of(centre_normal, at_centre));
lanes tress = 0.0f;
if (tress_count == 2) {
  tress = right > 0.0f ? lanes(0.5f) : lanes(0.0f);
} else {
  tress = up > abs_of(right) * 0.57735027f ? lanes(0.0f) : right > 0.0f ? lanes(1.0f / 3.0f) : lanes(2.0f / 3.0f);
}
const lanes phase = random_number(lock, seed, ints(CLUMP_PHASE)) + tress;
const auto wind = [&](lanes along, lanes& sine, lanes& cosine) {
  sine_and_cosine(phase + along * (1.0f / pitch), sine, cosine);
};
// Of a strand that also goes across: how far it gets along the centre by its length, 1 / sqrt(1 + |dρ/da|²).
const float steepness = 6.28318530718f * radius / pitch;
const auto rate_at = [&](lanes along, lanes amount) {
  lanes sine, cosine;
  wind(along, sine, cosine);
  const lanes over = 2.0f * flat * (cosine * cosine - sine * sine);
  const lanes square = tress_count == 2 ? lanes(1.0f) : cosine * cosine + over * over;
  const lanes across = steepness * amount;
  return 1.0f / sqrt_of(1.0f + across * across * square);
};
// Roots stay: what the profile asks for at the root is reached over twice the distance to the centre.
const lanes root_distance = 2.0f * sqrt_of(dot(course.low, course.low));
const auto is_apart = root_distance > 1.0e-9f;
const lanes per_root_distance = is_apart ? 1.0f / (is_apart ? root_distance : lanes(1.0f)) : lanes(1.0e9f);
vector point = {}, place = {}, middle_before = course.low;
vector axis_before = centre_normal, frame = at_centre, run = {}, own_run = t[1];
lanes arc = 0.0f, ahead = 0.0f, pull = 0.0f;
for (int i = 1; i < point_count; ++i) {
  const lanes d = length[i];
  arc += d;
  point = plus(point, t[i], d);
  // Directions are averaged over a fortieth of the strand.
  const lanes x = arc * per_total, share = lower_of(40.0f * d * per_total, lanes(1.0f));
  lanes wanted = profile(x);
  if (at_root > 0.0f) wanted = wanted - at_root * (1.0f - smoothstep(arc * per_root_distance));
  ahead += d * rate_at(ahead + 0.5f * d * rate_at(ahead, pull), pull);  // the midpoint method
  const vector middle = middle_at(course, ahead);
  // Where the strand is level with its progress along the centre.
  own_run = plus(own_run, t[i] - own_run, share);
  const vector away = plus(point, own_run, ahead - arc) - middle;
  // No faster than the strand can follow, however steep the profile is.
  const lanes most_change = d / higher_of(sqrt_of(dot(away, away)) + radius, lanes(1.0e-9f));
  pull += clamped(base * wanted - pull, -most_change, most_change);
  lanes sine, cosine;
  wind(ahead, sine, cosine);
  const lanes out = radius * pull;
  const lanes to_u = out * (tress_count == 2 ? cosine : sine);
  const lanes to_v = out * (tress_count == 2 ? sine : 2.0f * flat * sine * cosine);
  run = run + (middle - middle_before - run) * share;
  const vector axis = unit_or(run, lanes(1.0e-12f), axis_before);
  middle_before = middle;
  frame = turned(frame, axis_before, axis);
  axis_before = axis;
  const vector beside = away - axis * dot(away, axis);
  const vector drawn = middle + away * (1.0f - pull) + beside * (pull * thickness) + frame * to_u
      + upward_of(axis, frame) * to_v;
  const vector way = drawn - place;
  const lanes distance = sqrt_of(dot(way, way));
  const auto is_far = distance > 1.0e-3f * d;
  t[i] = chosen(is_far, way * (1.0f / (is_far ? distance : lanes(1.0f))), t[i]);
  next_length[i] = lower_of(distance, most_stretch * d);
  place = place + t[i] * next_length[i];
}
swap(length, next_length);
put_total();
