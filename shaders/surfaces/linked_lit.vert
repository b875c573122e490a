// SPDX-License-Identifier: GPL-3.0-or-later
// A corner of a triangle of linked surfaces, an instance for each: as surfaces/lit_surface.vert. Each surface has a layer of
// the textures of the world's visibility.

#include "surfaces/linked_transform.glsl"
#include "surfaces/surface_corner.glsl"

void main()
{
  Corner corner = corner_at(gl_VertexID);
  mat4 to_world = linked_transform(gl_InstanceID);
  corner_seen_x_y = texelFetch(visibility_x_y, ivec3(seen_texel_of(corner), gl_InstanceID), 0);
  corner_seen_z = texelFetch(visibility_z, ivec3(seen_texel_of(corner), gl_InstanceID), 0);
  surface_normal = corner_world_normal(corner, to_world);
  surface_uv = corner.uv;
  drawn_position = corner_position(corner, to_world);
  gl_Position = view.world_to_clip * vec4(drawn_position, 1.0);
}
