// SPDX-License-Identifier: GPL-3.0-or-later
// Segments of strands between adjacent points, in image space: needs the samplers strands and strand_radii.

#include "strands/level_of_detail.glsl"
#include "strands/packed_strand.glsl"

const float FOURTH_OF_PI = 0.785398163;  // a half disk's area divided by its width and its radius

// Index of the strand point at which a segment starts.
int piece_start(int piece)
{
  return piece * (view.point_count - 1) / (view.drawn_points - 1);
}

ivec2 strand_first(int strand)
{
  return packed_first(strand, 0, view.point_count, view.row_strands);
}

// The radii of a single strand are stored if they are the same for all.
float strand_radius(int strand, int point)
{
  ivec2 texel = strand_texel(min(strand, view.radius_strands - 1), point, view.point_count, view.row_strands);
  return texelFetch(strand_radii, texel, 0).r * view.radius_unit;
}

// A point and its radius; first: the strand's first texel, head: by `packed_head`.
vec4 strand_point(int strand, ivec2 first, vec4 head, int point)
{
  return vec4(packed_place(strands, first, head, point), strand_radius(strand, point));
}

// The part of a segment in front of the near plane.
struct Segment {
  vec3 start;  // [samples], and the depth from 0 to 1
  vec3 end;
  vec2 w;  // of clip space
  vec2 half_width;  // [samples]
  vec2 part;  // parameters of the ends between the two points
};

// Position of a clip-space point: [samples], and the depth from 0 to 1.
vec3 sample_place(vec4 clip, vec2 size)
{
  return (0.5 * clip.xyz / clip.w + 0.5) * vec3(size, 1.0);
}

vec4 to_clip(vec4 point)
{
  return view.object_to_clip * vec4(point.xyz, 1.0);
}

// Position [samples] of a perspective's axis in the picture.
vec2 axis_place(vec2 size)
{
  mat4 to_clip = view.object_to_clip;
  vec4 forward = vec4(to_clip[0][3], to_clip[1][3], to_clip[2][3], 0.0);
  return (view.is_perspective == 0) ? vec2(0.0) : sample_place(to_clip * forward, size).xy;
}

// Factor of the width of strands along a line of the picture [samples], relative to the middle: a perspective stretches
// everything off its axis. axis: from `axis_place`.
float width_stretch(vec2 start, vec2 end, vec2 axis)
{
  vec2 along = end - start;
  float squared = dot(along, along);
  if (view.is_perspective == 0 || squared < 1e-12) {
    return 1.0;
  }
  vec2 beside = start - axis;
  float distance = (beside.x * along.y - beside.y * along.x) / view.pixels_per_unit;
  return sqrt(1.0 + distance * distance / squared);
}

// Computes the segment in front of the near plane; false if all of it is behind. start, end: its points in clip space; size:
// of the picture [samples]; axis: from `axis_place`.
bool segment_in_front(vec4 start, vec4 end, vec2 radii, vec2 size, vec2 axis, out Segment segment)
{
  vec2 beyond = vec2(start.z + start.w, end.z + end.w);
  segment.part = vec2(0.0, 1.0);
  if (max(beyond.x, beyond.y) <= 0.0) {
    return false;
  }
  if (min(beyond.x, beyond.y) < 0.0) {
    float crossing = beyond.x / (beyond.x - beyond.y);
    segment.part = (beyond.x < 0.0) ? vec2(crossing, 1.0) : vec2(0.0, crossing);
    vec4 way = end - start;
    end = start + segment.part.y * way;
    start += segment.part.x * way;
    radii = mix(radii.xx, radii.yy, segment.part);
  }
  segment.w = max(vec2(start.w, end.w), vec2(1e-6));
  segment.start = sample_place(start, size);
  segment.end = sample_place(end, size);
  segment.half_width = radii * (view.object_scale * view.thickness * view.pixels_per_unit) / segment.w;
  segment.half_width *= width_stretch(segment.start.xy, segment.end.xy, axis);
  return true;
}

// Minimum sine of a strand's inclination to the view for the depth of the side that faces the viewer.
const float LEAST_SINE = 0.25;

// Difference of depth between the axis and the side of a round strand that faces the viewer, at both ends. way: distance
// between the two points.
vec2 depth_rises(Segment segment, float way)
{
  float full = way * view.object_scale * (segment.part.y - segment.part.x) * view.pixels_per_unit;
  float seen = distance(segment.start.xy, segment.end.xy) * 0.5 * (segment.w.x + segment.w.y);
  float sine = clamp(seen / max(full, 1e-20), LEAST_SINE, 1.0);
  return segment.half_width / segment.w * (view.depth_rise / sine);
}

// Parameter in [0, 1] along a segment of a position in the picture.
float place_on_segment(Segment segment, vec2 place)
{
  vec2 along = segment.end.xy - segment.start.xy;
  float on_screen = clamp(dot(place - segment.start.xy, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
  float near_end = on_screen * segment.w.x;  // perspective-correct
  return mix(segment.part.x, segment.part.y, near_end / mix(segment.w.y, segment.w.x, on_screen));
}
