// SPDX-License-Identifier: GPL-3.0-or-later
// One vertex of a strand's strip, fetched from the strand texture by index.

#include "visibility/coverage.glsl"
#include "visibility/segment.glsl"

void main()
{
  int strand, drawn_point;
  float side;
  strip_vertex(gl_VertexID, view.drawn_points, strand, drawn_point, side);
  strand = drawn_strand(strand);
  int point = piece_start(drawn_point);
  ivec2 first = strand_first(strand);
  vec4 head = packed_head(strands, first);
  vec4 here = strand_point(strand, first, head, point);
  vec3 along = packed_place(strands, first, head, min(point + 1, view.point_count - 1)) -
               packed_place(strands, first, head, max(point - 1, 0));
  // A strand has no tangent where it folds back on itself; any unit vector is valid.
  along = (dot(along, along) > 0.0) ? along : vec3(0.0, 0.0, 1.0);

  strand_index = strand;
  strand_place = float(drawn_point);
  strand_side_place = side;
  vec3 tangent = (view.object_to_world * vec4(along, 0.0)).xyz;
  drawn_position = (view.object_to_world * vec4(here.xyz, 1.0)).xyz;
  vec3 to_view = view.is_perspective != 0 ? view.eye.xyz - drawn_position : view.eye.xyz;
  // The picture's minimum half width at this depth.
  float depth = view.is_perspective != 0 ? (view.world_to_clip * vec4(drawn_position, 1.0)).w : 1.0;
  float true_half_width = here.w * view.object_scale * view.thickness;
  float half_sample = 0.5 * abs(depth) / view.pixels_per_unit;
  strand_offset_part = view.sample_offset * offset_share(0.5 * true_half_width / max(half_sample, 1e-20));
  float half_width = max(true_half_width, view.least_half_width * abs(depth)) + strand_offset_part * half_sample;
  strand_coverage = true_half_width / max(half_width, 1e-20);
  float sine = length(cross(normalize(tangent), normalize(to_view)));
  strand_rise = true_half_width * view.pixels_per_unit * view.depth_rise / max(depth * depth, 1e-20);
  strand_rise /= max(sine, LEAST_SINE);
  vec3 beside = strip_side(normalize(tangent), normalize(to_view));
  vec3 offset = beside * (side * half_width);
  if (drawn_point == 0 || drawn_point == view.drawn_points - 1) {
    // A strand ends in half a disk: the strip is extended by a rectangle of the same area.
    float beyond = (drawn_point == 0) ? -FOURTH_OF_PI : FOURTH_OF_PI;
    offset += cross(normalize(to_view), beside) * (beyond * end_share() * true_half_width);
  }
  gl_Position = view.world_to_clip * vec4(drawn_position + offset, 1.0);
}
