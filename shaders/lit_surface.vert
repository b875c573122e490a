// SPDX-License-Identifier: GPL-3.0-or-later
// A corner of a triangle, with its visibility of the world.

#include "include/vertex_place.glsl"

// A normal where a matrix brings what it is of: by its cofactors, which a flattened object has too. Where it mirrors,
// triangles turn their other side to the front, and their normals with it.
vec3 placed_normal(mat3 matrix, vec3 normal)
{
  vec3 placed = cross(matrix[1], matrix[2]) * normal.x + cross(matrix[2], matrix[0]) * normal.y +
                cross(matrix[0], matrix[1]) * normal.z;
  return placed * inversesqrt(max(dot(placed, placed), 1e-30));
}

void main()
{
  ivec2 texel = ivec2(corner_vertex % view.row_strands, corner_vertex / view.row_strands);
  corner_seen_x_y = texelFetch(visibility_x_y, texel, 0);
  corner_seen_z = texelFetch(visibility_z, texel, 0);
  surface_normal = placed_normal(mat3(view.object_to_world), vertex_place(normals, corner_normal));
  surface_uv = uv;
  drawn_position = (view.object_to_world * vec4(vertex_place(places, corner_vertex), 1.0)).xyz;
  gl_Position = view.world_to_clip * vec4(drawn_position, 1.0);
}
