// SPDX-License-Identifier: GPL-3.0-or-later
// Tresses of a braid or a rope around the centre of a lock (core/styling/weave.h).

#include "include/centre_course.glsl"

// How far a strand that also goes across gets along the centre by its length, 1 / sqrt(1 + |dρ/da|²).
// turns: of its tress there; across: how steeply it goes; flat_part: of a braid of three, 0 for a rope of two.
float weave_rate(float turns, float across, float flat_part, bool is_rope)
{
  vec2 wind = sine_and_cosine(turns);
  float over = 2.0 * flat_part * (wind.y * wind.y - wind.x * wind.x);
  float square = is_rope ? 1.0 : wind.y * wind.y + over * over;
  return 1.0 / sqrt(1.0 + across * across * square);
}

void weave(Step row)
{
  float radius = row.numbers[2].x;
  float pitch = row.numbers[2].y;
  float flat_part = row.numbers[2].z;
  bool is_rope = int(row.numbers[2].w) == 2;
  float thickness = row.numbers[3].x;
  const float most_stretch = 1.5;
  CentreCourse walk = begin_course();
  // The tress of a strand: by the angle about the lock's centre at which it is rooted.
  vec3 at_centre = reference(centre_normal, styling.axes);
  float right = -dot(walk.low.xyz, at_centre);
  float up = -dot(walk.low.xyz, upward_of(centre_normal, at_centre));
  float tress = 0.0;
  if (is_rope) {
    tress = (right > 0.0) ? 0.5 : 0.0;
  }
  else if (up <= abs(right) * 0.57735027) {
    tress = (right > 0.0) ? 1.0 / 3.0 : 2.0 / 3.0;
  }
  float phase = random_number(lock, row.seed, RANDOM_CLUMP_PHASE) + tress;
  float steepness = 6.28318530718 * radius / pitch;
  // Roots stay: what the profile asks for at the root is reached over twice the distance to the centre.
  float root_distance = 2.0 * length(walk.low.xyz);
  float per_root_distance = (root_distance > 1e-9) ? 1.0 / root_distance : 1e9;
  vec3 here = vec3(0.0);
  vec3 place = vec3(0.0);
  vec3 middle_before = walk.low.xyz;
  vec3 axis_before = centre_normal;
  vec3 frame = at_centre;
  vec3 run = vec3(0.0);
  vec3 own_run = segment_at(1).xyz;
  float arc = 0.0;
  float ahead = 0.0;
  float pull = 0.0;
  for (int i = 1; i < styling.point_count; i++) {
    vec4 own = segment_at(i);
    float d = own.w;
    arc += d;
    here += own.xyz * d;
    // Directions are averaged over a fortieth of the strand.
    float x = arc * per_total;
    float share = min(40.0 * d * per_total, 1.0);
    float wanted = profile(course, x);
    if (course.at_root > 0.0) {
      wanted -= course.at_root * (1.0 - smoothstep(0.0, 1.0, arc * per_root_distance));
    }
    // The midpoint method.
    float across = steepness * pull;
    float halfway = ahead + 0.5 * d * weave_rate(phase + ahead / pitch, across, flat_part, is_rope);
    ahead += d * weave_rate(phase + halfway / pitch, across, flat_part, is_rope);
    vec3 middle = middle_at(walk, ahead);
    // Where the strand is level with its progress along the centre.
    own_run += (own.xyz - own_run) * share;
    vec3 away = here - own_run * (arc - ahead) - middle;
    // No faster than the strand can follow, however steep the profile is.
    float most_change = d / max(length(away) + radius, 1e-9);
    pull += clamp(base_amount * wanted - pull, -most_change, most_change);
    vec2 wind = sine_and_cosine(phase + ahead / pitch);
    float out_by = radius * pull;
    float to_u = out_by * (is_rope ? wind.y : wind.x);
    float to_v = out_by * (is_rope ? wind.x : 2.0 * flat_part * wind.x * wind.y);
    run += (middle - middle_before - run) * share;
    vec3 axis = unit_or(run, 1e-12, axis_before);
    middle_before = middle;
    frame = turned(frame, axis_before, axis);
    axis_before = axis;
    vec3 beside = away - axis * dot(away, axis);
    vec3 drawn = middle + away * (1.0 - pull) + beside * (pull * thickness) + frame * to_u
                 + upward_of(axis, frame) * to_v;
    vec3 way = drawn - place;
    float distance_on = length(way);
    vec3 direction = (distance_on > 1e-3 * d) ? way / distance_on : own.xyz;
    float size = min(distance_on, most_stretch * d);
    put_segment(i, direction, size);
    place += direction * size;
  }
  put_total();
}
