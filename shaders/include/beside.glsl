// SPDX-License-Identifier: GPL-3.0-or-later
// A strand beside the centre strand of its lock, for styles by which the strands of a lock move together:
// core/styling/beside.h.

#include "include/centre_course.glsl"

struct Beside {
  float lead;  // [m] that the strand is ahead along the centre of where it would be, had they begun together
  int at;  // point of the centre where `segment_below` ends and `segment` begins: between their middles is the strand
  vec3 segment;
  vec3 segment_below;
  vec3 frame;  // at `segment_below`
  vec3 away;  // from the point to the strand's place
  float arc;  // at the point
  vec2 turn;  // cosine and sine, from the frames of the strand to those of the centre
};

// Read the segment that begins at point `at`; one without length has a nanometre in the direction of the one before.
void read_segment(inout Beside beside, vec3 axis_before)
{
  vec4 start = centre_point(beside.at);
  vec4 end = centre_point(beside.at + 1);
  beside.arc = start.w;
  beside.segment = (end.w - start.w > 1e-12) ? end.xyz - start.xyz : axis_before * 1e-9;
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
  beside.at = 0;
  beside.turn = vec2(1.0, 0.0);
  beside.away = strand_root - centre_point(0).xyz;
  read_segment(beside, centre_normal);
  beside.segment_below = beside.segment;
  vec3 axis = beside.segment / length(beside.segment);
  beside.frame = turned(at_centre, centre_normal, axis);
  vec3 first = segment_at(1).xyz;
  float facing = in_lock * smoothstep(0.0, 1.0, dot(first, axis));
  beside.lead = facing * dot(beside.away, axis);
  turn_by(beside, facing, turned(beside.frame, axis, first), u_first, upward_of(first, u_first));
  return beside;
}

// progress: how far along its path the strand is after a segment; forward: the segment's share of that.
void keep_beside(
    inout Beside beside, float progress, float forward, vec3 forwards, vec3 u, vec3 v, float per_settling
)
{
  float ahead = progress + beside.lead;
  beside.away += forwards * forward;
  float size = length(beside.segment);
  float size_below = length(beside.segment_below);
  vec3 axis_above = beside.segment / size;
  vec3 axis_below = beside.segment_below / size_below;
  while (beside.arc + 0.5 * size <= ahead && beside.at < POINTS - 2) {
    beside.at++;
    beside.frame = turned(beside.frame, axis_below, axis_above);
    beside.away -= beside.segment;
    beside.segment_below = beside.segment;
    size_below = size;
    axis_below = axis_above;
    read_segment(beside, axis_below);
    size = length(beside.segment);
    axis_above = beside.segment / size;
  }
  float between = clamp((ahead - beside.arc + 0.5 * size_below) / (0.5 * (size_below + size)), 0.0, 1.0);
  vec3 axis = unit_or(mix(axis_below, axis_above, between), 1e-6, axis_below);
  float facing = in_lock * smoothstep(0.0, 1.0, dot(forwards, axis));
  float part = facing * min(forward * per_settling, 0.45);
  float off = dot(beside.away, axis) + beside.arc - ahead;
  beside.lead += clamp(part * off, -0.5 * forward, 0.5 * forward);
  turn_by(beside, part, turned(turned(beside.frame, axis_below, axis), axis, forwards), u, v);
}

// An offset in the centre's frame, in the strand's.
vec2 in_centre_frame(Beside beside, vec2 offset)
{
  return vec2(offset.x * beside.turn.x - offset.y * beside.turn.y, offset.x * beside.turn.y + offset.y * beside.turn.x);
}
