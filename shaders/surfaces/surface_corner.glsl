// SPDX-License-Identifier: GPL-3.0-or-later
// Corners of a surface's triangles: needs the samplers places, normals and corners.

#include "surfaces/vertex_position.glsl"

struct Corner {
  int vertex_index;
  int normal_index;
  vec2 uv;
};

// The vertex is stored as two 16-bit numbers, as floats cannot represent all indices exactly.
Corner corner_at(int index)
{
  int row = textureSize(corners, 0).x;
  vec4 texel = texelFetch(corners, ivec2(index % row, index / row), 0);
  Corner corner;
  corner.vertex_index = int(texel.x) + 65536 * int(texel.y);
  corner.normal_index = (view.has_vertex_normals != 0) ? corner.vertex_index : index;
  corner.uv = texel.zw;
  return corner;
}

// The texel of a vertex in the textures of its visibility of the world.
ivec2 seen_texel_of(Corner corner)
{
  return ivec2(corner.vertex_index % view.row_strands, corner.vertex_index / view.row_strands);
}

vec3 corner_position(Corner corner, mat4 to_world)
{
  return (to_world * vec4(vertex_place(places, corner.vertex_index), 1.0)).xyz;
}

// Transforms a normal by the cofactors of the matrix, which also exist for flattened objects. A mirroring matrix turns the
// other side of triangles to the front, and flips the normals too.
vec3 corner_world_normal(Corner corner, mat4 to_world)
{
  vec3 normal = vertex_place(normals, corner.normal_index);
  mat3 matrix = mat3(to_world);
  vec3 placed = cross(matrix[1], matrix[2]) * normal.x + cross(matrix[2], matrix[0]) * normal.y +
                cross(matrix[0], matrix[1]) * normal.z;
  return placed * inversesqrt(max(dot(placed, placed), 1e-30));
}
