// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bend (bend.py): segments turn in one plane of the strand's frame.

const float angle = number[8], direction = number[9], random_turn = number[10];
vector* const u = next;
put_frames(u);
// ψ: towards the root's normal, in the frames of all segments; a strand along its normal takes the reference's.
lanes toward_u = 0.0f, toward_v = 0.0f;
for (int i = 1; i < point_count; ++i) {
  toward_u += dot(normal, u[i]);
  toward_v += dot(normal, upward_of(t[i], u[i]));
}
const lanes toward = sqrt_of(toward_u * toward_u + toward_v * toward_v);
const auto has_direction = toward > 1.0e-4f * (point_count - 1);
const lanes scale = 1.0f / (has_direction ? toward : lanes(1.0f));
const lanes psi_u = has_direction ? toward_u * scale : lanes(1.0f);
const lanes psi_v = has_direction ? toward_v * scale : lanes(0.0f);
lanes sine, cosine;
sine_and_cosine(direction + random_turn * (random(TURN) - 0.5f), sine, cosine);
const lanes cos_psi = psi_u * cosine - psi_v * sine, sin_psi = psi_u * sine + psi_v * cosine;
lanes arc = 0.0f;
for (int i = 1; i < point_count; ++i) {
  arc += length[i];
  lanes sin_angle, cos_angle;
  sine_and_cosine(base * angle * profile(arc * per_total), sin_angle, cos_angle);
  const vector sideways = plus(u[i] * cos_psi, upward_of(t[i], u[i]), sin_psi);
  t[i] = unit_or(plus(t[i] * cos_angle, sideways, sin_angle), lanes(1.0e-6f), t[i]);
}
