// SPDX-License-Identifier: GPL-3.0-or-later
// Bend (core/styling/bend.h): segments turn in one plane of the strand's frame.

#include "include/styled_strand.glsl"

void bend(Step row)
{
  float angle = row.numbers[2].x;
  float direction = row.numbers[2].y;
  float random_turn = row.numbers[2].z;
  // ψ: towards the root's normal, in the frames of all segments; a strand along its normal takes the reference's.
  vec2 toward = vec2(0.0);
  vec3 u = first_frame(reference(centre_normal, styling.axes));
  vec3 t_before = segment_at(1).xyz;
  for (int i = 1; i < styling.point_count; i++) {
    vec3 t = segment_at(i).xyz;
    if (i > 1) {
      u = turned(u, t_before, t);
    }
    put_next(i, u, 0.0);
    toward += vec2(dot(strand_normal, u), dot(strand_normal, upward_of(t, u)));
    t_before = t;
  }
  float size = length(toward);
  vec2 psi = (size > 1e-4 * float(POINTS - 1)) ? toward / size : vec2(1.0, 0.0);
  vec2 turn = sine_and_cosine(direction + random_turn * (random_of(row.seed, RANDOM_TURN) - 0.5));
  vec2 way = vec2(psi.x * turn.y - psi.y * turn.x, psi.x * turn.x + psi.y * turn.y);
  float arc = 0.0;
  for (int i = 1; i < styling.point_count; i++) {
    vec4 own = segment_at(i);
    arc += own.w;
    vec2 bent = sine_and_cosine(base_amount * angle * profile(course, arc * per_total));
    vec3 across = next_at(i).xyz;
    vec3 sideways = across * way.x + upward_of(own.xyz, across) * way.y;
    put_segment(i, unit_or(own.xyz * bent.y + sideways * bent.x, 1e-6, own.xyz), own.w);
  }
}
