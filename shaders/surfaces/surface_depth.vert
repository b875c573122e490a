// SPDX-License-Identifier: GPL-3.0-or-later
// Vertices of triangles by their places in a texture: there a driver has what was just uploaded at hand, as vertices may
// stay in the host's memory until they were drawn some times.

#include "surfaces/vertex_position.glsl"

void main()
{
  drawn_position = (view.object_to_world * vec4(vertex_place(places, gl_VertexID), 1.0)).xyz;
  gl_Position = view.world_to_clip * vec4(drawn_position, 1.0);
}
