// SPDX-License-Identifier: GPL-3.0-or-later
// A strand beside the centre strand of its lock, for styles by which the strands of a lock move together:
// core/styling/beside.h.

#include "include/centre_course.glsl"

struct Beside {
  float lead;  // [m] that the strand is ahead along the centre of where it would be, had they begun together
  int at;  // segment of the centre beside the strand, which ends at point at + 1
  vec3 axis;
  vec3 frame;
  vec3 end;
  float arc;  // at its end
  vec3 place;  // of the strand
  vec2 turn;  // cosine and sine, from the frames of the strand to those of the centre
};

// The direction of the segment that ends at point at + 1; that of the one before where it has no length.
vec3 read_segment(inout Beside beside)
{
  vec4 point = centre_point(beside.at + 1);
  float range = point.w - beside.arc;
  vec3 axis = (range > 1e-12) ? (point.xyz - beside.end) / range : beside.axis;
  beside.end = point.xyz;
  beside.arc = point.w;
  return axis;
}

// A part of the turn to the centre's frame, carried over to the strand's.
void turn_by(inout Beside beside, float part, vec3 carried, vec3 u, vec3 v)
{
  vec2 turn = beside.turn + (vec2(dot(carried, u), dot(carried, v)) - beside.turn) * part;
  float size = length(turn);
  beside.turn = (size > 1e-3) ? turn / size : vec2(1.0, 0.0);
}

// at_centre: the reference of the centre; u_first: the strand's first frame.
Beside begin_beside(vec3 at_centre, vec3 u_first)
{
  Beside beside;
  vec4 centre_root = centre_point(0);
  beside.at = 0;
  beside.end = centre_root.xyz;
  beside.arc = centre_root.w;
  beside.place = strand_root;
  beside.turn = vec2(1.0, 0.0);
  beside.axis = centre_normal;
  beside.axis = read_segment(beside);
  beside.frame = turned(at_centre, centre_normal, beside.axis);
  vec3 first = segment_at(1).xyz;
  float facing = in_lock * smoothstep(0.0, 1.0, dot(first, beside.axis));
  beside.lead = facing * dot(strand_root - centre_root.xyz, beside.axis);
  turn_by(beside, facing, turned(beside.frame, beside.axis, first), u_first, cross(first, u_first));
  return beside;
}

// progress: how far along its path the strand is after a segment; forward: the segment's share of that.
void keep_beside(
    inout Beside beside, float progress, float forward, vec3 forwards, vec3 u, vec3 v, float per_settling
)
{
  float ahead = progress + beside.lead;
  while (beside.arc <= ahead && beside.at < POINTS - 2) {
    beside.at++;
    vec3 next_axis = read_segment(beside);
    beside.frame = turned(beside.frame, beside.axis, next_axis);
    beside.axis = next_axis;
  }
  beside.place += forwards * forward;
  float facing = in_lock * smoothstep(0.0, 1.0, dot(forwards, beside.axis));
  float part = facing * min(forward * per_settling, 0.45);
  float off = dot(beside.place - beside.end, beside.axis) + beside.arc - ahead;
  beside.lead += clamp(part * off, -0.5 * forward, 0.5 * forward);
  turn_by(beside, part, turned(beside.frame, beside.axis, forwards), u, v);
}

// An offset in the centre's frame, in the strand's.
vec2 in_centre_frame(Beside beside, vec2 offset)
{
  return vec2(offset.x * beside.turn.x - offset.y * beside.turn.y, offset.x * beside.turn.y + offset.y * beside.turn.x);
}
