// SPDX-License-Identifier: GPL-3.0-or-later
// Prepares guides: their segments in the frames of their roots, the values that limit their weights, and their roots.

#include "strands/guide_interpolation.glsl"
#include "strands/strip.glsl"

vec3 guide_point(int guide, int point)
{
  ivec2 texel = strand_texel(guide, 3 * point, 3 * making.point_count, making.row_guides);
  return vec3(texelFetch(guide_points, texel, 0).r,
              texelFetch(guide_points, texel + ivec2(1, 0), 0).r,
              texelFetch(guide_points, texel + ivec2(2, 0), 0).r);
}

vec3 unit_or_zero(vec3 direction)
{
  float size = length(direction);
  return (size > 0.0) ? direction / size : vec3(0.0);
}

void main()
{
  int guide = int(gl_GlobalInvocationID.x);
  if (guide >= making.guide_count) {
    return;
  }
  int row = guide / making.row_normals;
  vec3 normal = texelFetch(guide_normals, ivec2(guide - row * making.row_normals, row), 0).xyz;
  vec3 tangent;
  vec3 bitangent;
  root_frame(normal, tangent, bitangent);
  int last = making.point_count - 1;
  ivec2 first = strand_texel(guide, 0, making.point_count + 2, making.row_segments);
  vec3 root = guide_point(guide, 0);
  vec3 before = root;
  vec3 lower = vec3(0.0);
  float total = 0.0;
  for (int point = 1; point <= last; point++) {
    vec3 here = guide_point(guide, point);
    vec3 offset = here - before;
    float size = length(offset);
    imageStore(segments,
               first + ivec2(point - 1, 0),
               vec4(dot(tangent, offset), dot(bitangent, offset), dot(normal, offset), size));
    total += size;
    if (point <= (last + 1) / 2) {
      lower += unit_or_zero(here - root);
    }
    before = here;
  }
  vec3 tip = before - root;
  lower = unit_or_zero(vec3(dot(tangent, lower), dot(bitangent, lower), dot(normal, lower)));
  tip = unit_or_zero(vec3(dot(tangent, tip), dot(bitangent, tip), dot(normal, tip)));
  imageStore(segments, first + ivec2(last, 0), vec4(lower, log(clamp(total, 1e-30, 1e30))));
  imageStore(segments, first + ivec2(last + 1, 0), vec4(tip, 0.0));
  imageStore(segments, first + ivec2(last + 2, 0), vec4(root, 0.0));
}
