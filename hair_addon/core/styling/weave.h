// SPDX-License-Identifier: GPL-3.0-or-later
//
// Tresses of a braid or a rope (braid.py) around the centre of a lock.

const float radius = number[8], pitch = number[9], flat = number[10], thickness = number[12];
const int tress_count = static_cast<int>(number[11]);
// The tress of a strand: by the angle about the lock's centre at which it is rooted.
vector away;
for (int lane = 0; lane < LANES; ++lane) {
  const auto& place = centre_points.data[size_t(centre[lane]) * point_count];
  set_lane(away.x, lane, get_lane(root.x, lane) - place[0]);
  set_lane(away.y, lane, get_lane(root.y, lane) - place[1]);
  set_lane(away.z, lane, get_lane(root.z, lane) - place[2]);
}
const vector at_centre = reference();
const lanes right = dot(away, at_centre), up = dot(away, cross(centre_normal, at_centre));
lanes tress = 0.0f;
if (tress_count == 2) {
  tress = right > 0.0f ? lanes(0.5f) : lanes(0.0f);
} else {
  tress = up > abs_of(right) * 0.57735027f ? lanes(0.0f) : right > 0.0f ? lanes(1.0f / 3.0f) : lanes(2.0f / 3.0f);
}
const lanes phase = random_number(lock, seed, ints(CLUMP_PHASE)) + tress;
gather(thickness, 0.0f, lanes(1.0f), radius, [&](lanes arc, lanes amount, lanes& to_u, lanes& to_v) {
  lanes sine, cosine;
  sine_and_cosine(phase + arc * (1.0f / pitch), sine, cosine);
  to_u = radius * amount * (tress_count == 2 ? cosine : sine);
  to_v = radius * amount * (tress_count == 2 ? sine : 2.0f * flat * sine * cosine);
});
