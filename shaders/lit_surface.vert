// SPDX-License-Identifier: GPL-3.0-or-later
// A corner of a triangle, with its visibility of the world.

void main()
{
  ivec2 texel = ivec2(gl_VertexID % view.row_strands, gl_VertexID / view.row_strands);
  corner_seen_x_y = texelFetch(visibility_x_y, texel, 0);
  corner_seen_z = texelFetch(visibility_z, texel, 0);
  surface_normal = normal;
  surface_uv = uv;
  drawn_position = position;
  gl_Position = view.world_to_clip * vec4(position, 1.0);
}
