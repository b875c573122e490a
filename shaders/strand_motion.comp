// SPDX-License-Identifier: GPL-3.0-or-later
// Motion vectors of strands.

#include "include/motion.glsl"
#include "include/strand_samples.glsl"

// Which of the combed strands this one is, counted from one; 0: it was not combed.
int moved_row(int strand)
{
  ivec2 texel = ivec2(strand % view.row_strands, strand / view.row_strands);
  return (motion.moved_row_strands > 0) ? int(texelFetch(moved_rows, texel, 0).r) : 0;
}

vec4 sample_value()
{
  float place = strand_position * float(view.point_count - 1);
  int point = min(int(place), view.point_count - 2);
  ivec2 first = strand_texel(strand_index, point, view.point_count, view.row_strands);
  ivec2 next = ivec2(1, 0);
  float t = place - float(point);
  vec3 now = mix(texelFetch(strands, first, 0).xyz, texelFetch(strands, first + next, 0).xyz, t);
  vec3 after = mix(texelFetch(strands_after, first, 0).xyz, texelFetch(strands_after, first + next, 0).xyz, t);
  vec3 before;
  int row = moved_row(strand_index);
  if (row > 0) {
    first = strand_texel(row - 1, point + 1, view.point_count + 1, motion.moved_row_strands);
    before = mix(texelFetch(moved_points, first, 0).xyz, texelFetch(moved_points, first + next, 0).xyz, t);
  }
  else {
    before = mix(texelFetch(strands_before, first, 0).xyz, texelFetch(strands_before, first + next, 0).xyz, t);
  }
  return moved(motion.now_to_clip * vec4(now, 1.0),
               motion.before_to_clip * vec4(before, 1.0),
               motion.after_to_clip * vec4(after, 1.0),
               motion.size.xy);
}
