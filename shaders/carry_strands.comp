// SPDX-License-Identifier: GPL-3.0-or-later
// Carries strands from where they are at rest with their surface: core/geometry/surface_deform.py on any GPU.
// Where points were before is left for motion vectors, and the box of each strand for what is around all.

#include "include/strand.glsl"
#include "include/surface_turn.glsl"

// Texels of a strand in `roots`: the vertices around it, its barycentric coordinates, and its place at rest; of a vertex
// in `vertices`: where it is now and whether it has moved, and where its turn takes the x and the y axis.
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
  vec3 from = texelFetch(roots, root + ivec2(2, 0), 0).xyz;
  vec3 to = vec3(0.0);
  vec3 x_axis = vec3(0.0);
  vec3 y_axis = vec3(0.0);
  float change = 0.0;
  int row_vertices = textureSize(vertices, 0).x / VERTEX_TEXELS;
  for (int corner = 0; corner < 3; corner++) {
    ivec2 vertex = strand_texel(int(corners[corner]), 0, VERTEX_TEXELS, row_vertices);
    vec4 place = texelFetch(vertices, vertex, 0);
    to += barycentric[corner] * place.xyz;
    x_axis += barycentric[corner] * texelFetch(vertices, vertex + ivec2(1, 0), 0).xyz;
    y_axis += barycentric[corner] * texelFetch(vertices, vertex + ivec2(2, 0), 0).xyz;
    change += place.w;
  }
  mat3 turn = surface_turn(x_axis, y_axis);
  ivec2 here = strand_texel(strand, 0, point_count, row_strands);
  ivec2 past = strand_texel(strand, 1, point_count + 1, row_moved);
  vec3 least = vec3(1.0e30);
  vec3 greatest = vec3(-1.0e30);
  for (int point = 0; point < point_count; point++) {
    ivec2 texel = here + ivec2(point, 0);
    vec4 place = texelFetch(rest, texel, 0);
    if (change > 0.0) {  // undeformed parts do not change, bit for bit
      place.xyz = to + turn * (place.xyz - from);
    }
    least = min(least, place.xyz);
    greatest = max(greatest, place.xyz);
    if (row_moved > 0) {
      imageStore(moved_strands, past + ivec2(point, 0), imageLoad(strands, texel));
    }
    imageStore(strands, texel, place);
  }
  ivec2 box = strand_texel(strand, 0, 2, imageSize(boxes).x / 2);
  imageStore(boxes, box, vec4(least, 0.0));
  imageStore(boxes, box + ivec2(1, 0), vec4(greatest, 0.0));
}
