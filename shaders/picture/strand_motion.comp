// SPDX-License-Identifier: GPL-3.0-or-later
// Motion vectors of strands: HAS_AFTER: also from the next frame.

#include "picture/motion.glsl"
#include "picture/object_motion.glsl"
#include "visibility/strand_hit.glsl"

// Index of a strand among combed strands, counted from one; 0: not combed.
int moved_row(int strand)
{
  ivec2 texel = ivec2(strand % view.row_strands, strand / view.row_strands);
  return (motion.moved_row_strands > 0) ? int(texelFetch(moved_rows, texel, 0).r) : 0;
}

// Position between a point of a strand and the next.
vec3 place_between(sampler2D texels, ivec2 first, int point, float t)
{
  vec4 head = packed_head(texels, first);
  return mix(packed_place(texels, first, head, point), packed_place(texels, first, head, point + 1), t);
}

vec4 sample_value()
{
  float place = strand_position * float(view.point_count - 1);
  int point = min(int(place), view.point_count - 2);
  ivec2 first = strand_first(strand_index);
  float t = place - float(point);
  vec3 now = place_between(strands, first, point, t);
  vec4 now_clip = now_to_clip() * vec4(now, 1.0);
  vec4 after_clip = now_clip;
  if (HAS_AFTER) {
    after_clip = after_to_clip() * vec4(place_between(strands_after, first, point, t), 1.0);
  }
  vec3 before;
  int row = moved_row(strand_index);
  if (row > 0) {
    first = packed_first(row - 1, 1, view.point_count, motion.moved_row_strands);
    before = place_between(moved_points, first, point, t);
  }
  else {
    before = place_between(strands_before, first, point, t);
  }
  return moved(now_clip, before_to_clip() * vec4(before, 1.0), after_clip, motion.size.xy);
}

#include "visibility/strand_samples.glsl"
