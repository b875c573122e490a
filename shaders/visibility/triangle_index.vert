// SPDX-License-Identifier: GPL-3.0-or-later
// A corner of a triangle, with the triangle's index.

#include "surfaces/surface_corner.glsl"

void main()
{
  triangle = first_triangle + gl_VertexID / 3;
  gl_Position = view.world_to_clip * vec4(corner_position(corner_at(gl_VertexID), view.object_to_world), 1.0);
}
