// SPDX-License-Identifier: GPL-3.0-or-later
//
// Tresses of a braid or a rope (braid.py), around strands that a clump has gathered.

const float radius = number[8], pitch = number[9], flat = number[10];
const int tress_count = static_cast<int>(number[11]);
// The tress of a strand: by the angle about the lock's centre at which it is rooted.
put_frames();
vector away = {0.0f, 0.0f, 0.0f};
if (level >= 0) {
  for (int lane = 0; lane < LANES; ++lane) {
    const auto& place = centre_points.data[size_t(centre[lane]) * point_count];
    set_lane(away.x, lane, get_lane(root.x, lane) - place[0]);
    set_lane(away.y, lane, get_lane(root.y, lane) - place[1]);
    set_lane(away.z, lane, get_lane(root.z, lane) - place[2]);
  }
}
const vector at_root = turned(u[1], t[1], normal);
const lanes right = dot(away, at_root), up = dot(away, cross(normal, at_root));
lanes tress = 0.0f;
if (tress_count == 2) {
  tress = right > 0.0f ? lanes(0.5f) : lanes(0.0f);
} else {
  tress = up > abs_of(right) * 0.57735027f ? lanes(0.0f) : right > 0.0f ? lanes(1.0f / 3.0f) : lanes(2.0f / 3.0f);
}
const float width = 2.0f * 3.14159265f * radius;
lanes turns = random_number(lock, seed, ints(CLUMP_PHASE)) + tress;
lanes before = 0.0f;
const auto woven = [&](lanes phase, lanes amount, lanes& to_u, lanes& to_v) {
  lanes sine, cosine;
  sine_and_cosine(phase, sine, cosine);
  to_u = amount * (tress_count == 2 ? cosine : sine);
  to_v = amount * (tress_count == 2 ? sine : 2.0f * flat * sine * cosine);
};
lanes root_u, root_v;
woven(turns, base * radius * profile(lanes(0.0f)), root_u, root_v);
move_across(
    [&](int, lanes s, lanes x, lanes& to_u, lanes& to_v) {
      const lanes wound = base * profile(x);
      turns += (s - before) / sqrt_of(width * width * 0.5f * wound * wound + pitch * pitch);
      before = s;
      woven(turns, wound * radius, to_u, to_v);
    },
    root_u,
    root_v
);
