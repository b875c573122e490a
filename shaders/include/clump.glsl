// SPDX-License-Identifier: GPL-3.0-or-later
// Clump (core/styling/clump.h, gather.h): strands gather around the centre strand of their lock. They follow the curve
// of points that are drawn to it, as far as their own length goes.

#include "include/centre_course.glsl"

void clump(Step row)
{
  float thickness = row.numbers[2].x;
  float twist = row.numbers[2].y;
  float stray = row.numbers[2].z;
  float joined = 1.0;
  if (stray > 0.0) {
    joined = clamp((random_of(row.seed, RANDOM_STRAY) - 1.1 * stray) * 10.0 + 1.0, 0.0, 1.0);
  }
  CentreCourse walk = begin_course();
  // Roots stay: what the profile asks for at the root is reached over twice the distance to the centre.
  float root_distance = 2.0 * length(walk.low.xyz);
  float per_root_distance = (root_distance > 1e-9) ? 1.0 / root_distance : 1e9;
  vec3 here = vec3(0.0);
  vec3 place = vec3(0.0);
  vec3 drawn_before = vec3(0.0);
  vec3 middle_before = walk.low.xyz;
  vec3 axis_before = centre_normal;
  vec3 run = vec3(0.0);
  vec3 own_run = segment_at(1).xyz;
  float arc = 0.0;
  float ahead = 0.0;
  float rate = 1.0;
  float lead = 0.0;
  float weight = 0.0;
  float pull_before = 0.0;
  for (int i = 1; i < styling.point_count; i++) {
    vec4 own = segment_at(i);
    float d = own.w;
    arc += d;
    here += own.xyz * d;
    // Corrections are made per length, that of a fortieth of the strand: finer segments correct less each. The same
    // corrections at each of many points would be chaotic, as differences of near points are mostly rounding.
    float share = min(40.0 * d * per_total, 1.0);
    float advance = d + (clamp(rate * (d - 0.5 * share * lead), 0.25 * d, 1.25 * d) - d) * weight;
    ahead += advance;
    vec3 middle = middle_at(walk, ahead);
    float x = arc * per_total;
    float wanted = profile(course, x);
    // Where the strand is level with its progress along the centre: by its direction over about that length.
    own_run += (own.xyz - own_run) * share;
    vec3 away = here - own_run * (arc - ahead) - middle;
    if (twist != 0.0) {
      // The centre's direction over about that length, which has no steps.
      run += (middle - middle_before - run) * share;
      vec3 axis = unit_or(run, 1e-12, axis_before);
      middle_before = middle;
      axis_before = axis;
      // Rodrigues' rotation.
      vec2 turn = sine_and_cosine(twist * wanted * base_amount);
      away = away * turn.y + upward_of(axis, away) * turn.x + axis * (dot(axis, away) * (1.0 - turn.y));
    }
    if (course.at_root > 0.0) {
      wanted -= course.at_root * (1.0 - smoothstep(0.0, 1.0, arc * per_root_distance));
    }
    // No faster than the strand can follow, however steep the profile is.
    float pull = base_amount * joined * wanted;
    float change = pull - pull_before;
    float way_square = dot(away, away);
    if (change * change * way_square > d * d) {
      float most_change = d / sqrt(way_square);
      pull = pull_before + clamp(change, -most_change, most_change);
    }
    pull_before = pull;
    vec3 drawn = middle + away * (1.0 - pull * (1.0 - thickness));
    // Along the curve, and back onto it from beside it, the more the nearer to the centre it is drawn: by degrees where
    // that is far away.
    weight = pull * pull;
    vec3 way_on = drawn - drawn_before;
    float distance_on = length(way_on);
    bool is_far = distance_on > 1e-3 * d;
    vec3 forwards = is_far ? way_on / distance_on : way_on;
    // A strand that is far from the curve keeps its direction to it, whichever way the curve goes.
    float spacing = max(0.025 * total, d);
    vec3 off = drawn_before - place;
    float off_square = dot(off, off);
    if (off_square > spacing * spacing) {
      off *= spacing / sqrt(off_square);
    }
    vec3 beside = off - forwards * dot(off, forwards);
    float square = dot(beside, beside);
    float most = 0.25 * spacing * spacing;
    float back = 0.7 * share;
    if (square > most) {
      back *= sqrt(most / square);
    }
    vec3 direction = is_far ? unit_or(way_on + beside * (back * weight), 1e-18, own.xyz) : own.xyz;
    put_segment(i, direction, d);
    place += direction * d;
    drawn_before = drawn;
    // The strand's progress along the centre: as far as its length goes along the curve.
    float rate_here = (distance_on > 0.5 * advance) ? advance / distance_on : 2.0;
    rate += 0.5 * share * (min(rate_here, 1.25) - rate);
    lead = dot(drawn - place, forwards);
  }
}
