// SPDX-License-Identifier: GPL-3.0-or-later
// Motion vectors of strands.

#include "include/motion.glsl"
#include "include/strand_samples.glsl"

vec4 sample_value()
{
  float place = strand_position * float(view.point_count - 1);
  int point = min(int(place), view.point_count - 2);
  ivec2 first = strand_texel(strand_index, point, view.point_count, view.row_strands);
  ivec2 second = first + ivec2(1, 0);
  float t = place - float(point);
  vec3 now = mix(texelFetch(strands, first, 0).xyz, texelFetch(strands, second, 0).xyz, t);
  vec3 before = mix(texelFetch(strands_before, first, 0).xyz, texelFetch(strands_before, second, 0).xyz, t);
  vec3 after = mix(texelFetch(strands_after, first, 0).xyz, texelFetch(strands_after, second, 0).xyz, t);
  return moved(motion.now_to_clip * vec4(now, 1.0),
               motion.before_to_clip * vec4(before, 1.0),
               motion.after_to_clip * vec4(after, 1.0),
               motion.size.xy);
}
