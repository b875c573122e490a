// SPDX-License-Identifier: GPL-3.0-or-later
// The strand in a sample and the position along it, for shading.

#include "visibility/segment.glsl"

int strand_index;
float strand_position;  // root 0 to tip 1
vec3 strand_tangent;
vec3 drawn_position;
float drawn_radius;
Segment drawn_segment;  // of the picture
vec2 sample_at;  // [samples]

// Unnormalized direction of a strand at a point; arbitrary where the strand folds back on itself.
vec3 tangent_at(vec3 before, vec3 after)
{
  vec3 along = after - before;
  return (dot(along, along) > 0.0) ? along : vec3(0.0, 0.0, 1.0);
}

// Unit direction of a strand at its root, in the world.
vec3 root_direction(int strand)
{
  ivec2 first = strand_first(strand);
  vec4 head = packed_head(strands, first);
  vec3 along = packed_place(strands, first, head, 1) - head.xyz;
  return normalize(mat3(view.object_to_world) * tangent_at(vec3(0.0), along));
}

// Sets the variables above for segment `index` of the strands, in a sample at `at` [samples].
void find_place(int index, vec2 at, vec2 size)
{
  int pieces = view.drawn_points - 1;
  strand_index = index / pieces;
  int piece = index % pieces;
  int start = piece_start(piece);
  int end = piece_start(piece + 1);
  ivec2 texel = strand_first(strand_index);
  vec4 head = packed_head(strands, texel);
  vec4 first = strand_point(strand_index, texel, head, start);
  vec4 second = strand_point(strand_index, texel, head, end);
  sample_at = at;
  vec2 radii = vec2(first.w, second.w);
  bool is_in_front = segment_in_front(to_clip(first), to_clip(second), radii, size, axis_place(size), drawn_segment);
  float t = is_in_front ? place_on_segment(drawn_segment, at) : 0.0;
  if (end - start > 1) {
    // The light is that of the strand's own place: with fewer points strands cut through the hair below them, where it is
    // dark.
    float place = mix(float(start), float(end), t);
    start = min(int(place), end - 1);
    end = start + 1;
    t = place - float(start);
    first = strand_point(strand_index, texel, head, start);
    second = strand_point(strand_index, texel, head, end);
  }
  vec3 before = packed_place(strands, texel, head, max(start - 1, 0));
  vec3 after = packed_place(strands, texel, head, min(end + 1, view.point_count - 1));
  vec3 near_start = packed_place(strands, texel, head, start + 1);
  vec3 near_end = packed_place(strands, texel, head, end - 1);
  vec3 tangent = mix(tangent_at(before, near_start), tangent_at(near_end, after), t);
  strand_position = mix(float(start), float(end), t) / float(view.point_count - 1);
  strand_tangent = normalize(mat3(view.object_to_world) * tangent);
  drawn_radius = mix(first.w, second.w, t) * view.object_scale;
  drawn_position = (view.object_to_world * vec4(mix(first.xyz, second.xyz, t), 1.0)).xyz;
}
