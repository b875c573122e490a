// SPDX-License-Identifier: GPL-3.0-or-later
// Points that a style moves across their strand: core/styling/across.h. Given ρ_i in the frames,
//
//   w_i = ρ_i - ρ_(i-1), held to 0.98 d_i;  e_i = sqrt(d_i² - |w_i|²);  o'_i = e_i t(a) + w_i,u u(a) + w_i,v v(a)
//
// where a is the strand's own progress Σ e_j.

#include "include/styled_strand.glsl"

// Where a walk across the strand is: between the middles of the segments around its progress.
struct Walk {
  int at;
  float below;
  float above;
  float end;  // arc length at the end of the second segment
  vec3 t_below;
  vec3 u_below;
  vec3 t_above;
  vec3 u_above;
  float progress;
  vec2 before;  // ρ of the point before
};

// What a walk has found of a segment.
struct Passed {
  float forward;  // e
  vec3 forwards;
  vec3 sideways;
  vec3 upward;
};

// u_first: the first segment's frame; before: ρ_0.
Walk begin_across(vec3 u_first, vec2 before)
{
  Walk walk;
  vec4 first = segment_at(1);
  walk.at = 1;
  walk.below = 0.5 * first.w;
  walk.above = walk.below;
  walk.end = first.w;
  walk.t_below = first.xyz;
  walk.u_below = u_first;
  walk.t_above = first.xyz;
  walk.u_above = u_first;
  if (POINTS > 2) {
    vec4 second = segment_at(min(2, POINTS - 1));
    walk.above = walk.end + 0.5 * second.w;
    walk.end += second.w;
    walk.t_above = second.xyz;
    walk.u_above = turned(walk.u_below, walk.t_below, walk.t_above);
  }
  walk.progress = 0.0;
  walk.before = before;
  return walk;
}

// Segment i, to the point at an offset ρ_i.
Passed pass_across(inout Walk walk, int i, vec2 offset, float keep_length)
{
  vec4 own = segment_at(i);
  float d = own.w;
  vec2 w = offset - walk.before;
  walk.before = offset;
  float square = dot(w, w);
  float most = 0.9604 * d * d;
  if (square > most) {
    w *= sqrt(most / square);
  }
  Passed passed;
  passed.forward = sqrt(max(d * d - dot(w, w), 0.0));
  float size = d;
  if (keep_length != 1.0) {
    passed.forward = (1.0 - keep_length) * d + keep_length * passed.forward;
    size = sqrt(passed.forward * passed.forward + dot(w, w));
  }
  float middle = walk.progress + 0.5 * passed.forward;
  walk.progress += passed.forward;
  // The frame at `middle`, between those of the segments around it.
  while (walk.above <= middle && walk.at < POINTS - 2) {
    walk.below = walk.above;
    walk.t_below = walk.t_above;
    walk.u_below = walk.u_above;
    walk.at++;
    vec4 above = segment_at(walk.at + 1);
    walk.t_above = above.xyz;
    walk.above = walk.end + 0.5 * above.w;
    walk.end += above.w;
    walk.u_above = turned(walk.u_below, walk.t_below, walk.t_above);
  }
  float range = walk.above - walk.below;
  float part = (range > 1e-12) ? clamp((middle - walk.below) / range, 0.0, 1.0) : 0.0;
  vec3 t_between = walk.t_below + (walk.t_above - walk.t_below) * part;
  vec3 u_between = walk.u_below + (walk.u_above - walk.u_below) * part;
  // Opposite directions cancel each other: from a right angle on the frame halfway takes part.
  float facing = dot(walk.t_below, walk.t_above);
  if (facing < 0.0) {
    float bulge = -facing * 4.0 * part * (1.0 - part);
    vec3 between = (facing > 1e-6 - 1.0) ? walk.t_below + walk.t_above : upward_of(walk.t_below, walk.u_below);
    between = unit_or(between, 1e-6, walk.t_below);
    t_between += between * bulge;
    u_between += turned(walk.u_below, walk.t_below, between) * bulge;
  }
  passed.forwards = unit_or(t_between, 1e-6, walk.t_below);
  passed.sideways = unit_or(
      u_between - passed.forwards * dot(u_between, passed.forwards), 1e-6, walk.u_below
  );
  passed.upward = upward_of(passed.forwards, passed.sideways);
  if (d > 1e-12) {
    vec3 nearly = (passed.forwards * passed.forward + passed.sideways * w.x + passed.upward * w.y) / size;
    // Unit but for rounding, which a step of Newton's method takes away.
    put_next(i, nearly * (1.5 - 0.5 * dot(nearly, nearly)), size);
  }
  else {
    put_next(i, own.xyz, d);
  }
  return passed;
}

void end_across(float keep_length)
{
  exchange();
  if (keep_length != 1.0) {
    put_total();
  }
}
