// SPDX-License-Identifier: GPL-3.0-or-later
// Rotations of a surface at its vertices, from their positions only: core/geometry/vertex_turns.py on any GPU.

#include "strands/nearest_rotation.glsl"
#include "surfaces/vertex_position.glsl"

// Texels of a face in `faces`: columns of the inverse of its edges and normal at rest, each with one of its vertices. Texels
// of a vertex in `turned`: see strands/carry_strands.comp. A vertex in `rings`: its index, and the start and end of its faces
// in `around`.
const int FACE_TEXELS = 3;
const int TURNED_TEXELS = 3;

bool are_apart(vec3 one, vec3 other)
{
  return any(notEqual(one, other));
}

float greatest(vec3 values)
{
  return max(abs(values.x), max(abs(values.y), abs(values.z)));
}

void main()
{
  int here = int(gl_WorkGroupID.x * gl_WorkGroupSize.x + gl_LocalInvocationID.x);
  if (here >= vertex_count) {
    return;
  }
  vec4 ring = texelFetch(rings, strand_texel(here, 0, 1, textureSize(rings, 0).x), 0);
  mat3 total = mat3(vec3(0.0), vec3(0.0), vec3(0.0));
  bool is_turned = false;
  for (int index = int(ring.y); index < int(ring.z); index++) {
    int face = int(texelFetch(around, strand_texel(index, 0, 1, textureSize(around, 0).x), 0).r);
    ivec2 texel = strand_texel(face, 0, FACE_TEXELS, textureSize(faces, 0).x / FACE_TEXELS);
    vec4 column_0 = texelFetch(faces, texel, 0);
    vec4 column_1 = texelFetch(faces, texel + ivec2(1, 0), 0);
    vec4 column_2 = texelFetch(faces, texel + ivec2(2, 0), 0);
    vec3 first = vertex_place(now, int(column_0.w));
    vec3 second = vertex_place(now, int(column_1.w));
    vec3 last = vertex_place(now, int(column_2.w));
    is_turned = is_turned || are_apart(first, vertex_place(smooth_rest, int(column_0.w))) ||
                are_apart(second, vertex_place(smooth_rest, int(column_1.w))) ||
                are_apart(last, vertex_place(smooth_rest, int(column_2.w)));
    vec3 along = second - first;
    vec3 across = last - first;
    // Scaled, as squares of short edges would be zero.
    float reach = max(max(greatest(along), greatest(across)), 1.0e-30);
    vec3 normal = cross(along / reach, across / reach);
    float size = length(normal);
    normal = (size > 0.0) ? normal / size : vec3(0.0);
    total += mat3(along, across, normal) * mat3(column_0.xyz, column_1.xyz, column_2.xyz);
  }
  mat3 turn = unturned();
  if (is_turned) {
    turn = nearest_rotation(total);
  }
  vec3 now_here = vertex_place(now, int(ring.x));
  bool is_moved = are_apart(turn[0], vec3(1.0, 0.0, 0.0)) || are_apart(turn[1], vec3(0.0, 1.0, 0.0)) ||
                  are_apart(now_here, vertex_place(rest_places, int(ring.x)));
  ivec2 texel = strand_texel(here, 0, TURNED_TEXELS, imageSize(turned).x / TURNED_TEXELS);
  imageStore(turned, texel, vec4(now_here, is_moved ? 1.0 : 0.0));
  imageStore(turned, texel + ivec2(1, 0), vec4(turn[0], 0.0));
  imageStore(turned, texel + ivec2(2, 0), vec4(turn[1], 0.0));
}
