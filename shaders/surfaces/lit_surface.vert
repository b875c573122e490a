// SPDX-License-Identifier: GPL-3.0-or-later
// A corner of a triangle, with its visibility of the world.

#include "surfaces/surface_corner.glsl"

void main()
{
  Corner corner = corner_at(gl_VertexID);
  corner_seen_x_y = texelFetch(visibility_x_y, seen_texel_of(corner), 0);
  corner_seen_z = texelFetch(visibility_z, seen_texel_of(corner), 0);
  surface_normal = corner_world_normal(corner, view.object_to_world);
  surface_uv = corner.uv;
  drawn_position = corner_position(corner, view.object_to_world);
  gl_Position = view.world_to_clip * vec4(drawn_position, 1.0);
}
