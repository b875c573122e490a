// SPDX-License-Identifier: GPL-3.0-or-later
// Deforms strands with their surface: core/geometry/surface_deform.py on any GPU. Also writes the bounding box of each
// strand.

#include "strands/packed_strand.glsl"
#include "strands/surface_rotation.glsl"

// Texels of a strand in `roots`: the vertices around its root, barycentric coordinates, and its first point at rest with a
// flag whether that differs from the root. Texels of a vertex in `vertices`, by strands/vertex_rotations.comp: its position
// with a flag whether it has moved, and its rotated x and y axes. is_posed: 0 if the surface is at rest.
const int ROOT_TEXELS = 3;
const int VERTEX_TEXELS = 3;

void main()
{
  int group = int(gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x);
  int strand = group * int(gl_WorkGroupSize.x) + int(gl_LocalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  ivec2 root = strand_texel(strand, 0, ROOT_TEXELS, textureSize(roots, 0).x / ROOT_TEXELS);
  vec3 corners = texelFetch(roots, root, 0).xyz;
  vec3 barycentric = texelFetch(roots, root + ivec2(1, 0), 0).xyz;
  vec4 from = texelFetch(roots, root + ivec2(2, 0), 0);
  vec3 to = vec3(0.0);
  vec3 x_axis = vec3(0.0);
  vec3 y_axis = vec3(0.0);
  float change = 0.0;
  int row_vertices = textureSize(vertices, 0).x / VERTEX_TEXELS;
  for (int corner = 0; corner < 3; corner++) {
    ivec2 texel = strand_texel(int(corners[corner]), 0, VERTEX_TEXELS, row_vertices);
    vec4 place = texelFetch(vertices, texel, 0);
    to += barycentric[corner] * place.xyz;
    x_axis += barycentric[corner] * texelFetch(vertices, texel + ivec2(1, 0), 0).xyz;
    y_axis += barycentric[corner] * texelFetch(vertices, texel + ivec2(2, 0), 0).xyz;
    change += place.w;
  }
  mat3 turn = surface_turn(x_axis, y_axis);
  ivec2 here = packed_first(strand, 0, point_count, row_strands);
  vec4 head = packed_head(rest, here);
  vec4 carried = head;
  bool is_carried = change > 0.0 || (is_posed == 1 && from.w > 0.0);  // undeformed parts stay exactly the same
  if (is_carried) {
    // A rotated offset is within the diagonal of its former range.
    carried = vec4(to + turn * (head.xyz - from.xyz), 1.7321 * head.w);
  }
  imageStore(strands, here, vec4(carried.xy, 0.0, 0.0));
  imageStore(strands, here + ivec2(1, 0), vec4(carried.zw, 0.0, 0.0));
  vec3 least = carried.xyz;
  vec3 greatest = carried.xyz;
  for (int point = 1; point < point_count; point++) {
    ivec2 texel = here + ivec2(HEAD_TEXELS - 1 + point, 0);
    vec2 bits = texelFetch(rest, texel, 0).xy;
    vec3 offset = unpacked_offset(bits, head.w);
    if (is_carried) {
      offset = turn * offset;
      bits = packed_offset(offset, carried.w);
    }
    least = min(least, carried.xyz + offset);
    greatest = max(greatest, carried.xyz + offset);
    imageStore(strands, texel, vec4(bits, 0.0, 0.0));
  }
  ivec2 box = strand_texel(strand, 0, 2, imageSize(boxes).x / 2);
  imageStore(boxes, box, vec4(least, 0.0));
  imageStore(boxes, box + ivec2(1, 0), vec4(greatest, 0.0));
}
