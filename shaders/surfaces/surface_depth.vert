// SPDX-License-Identifier: GPL-3.0-or-later
// Vertices of triangles with positions from a texture: it is in GPU memory once uploaded, while drivers may keep vertex
// buffers in the host's memory until they were drawn several times.

#include "surfaces/vertex_position.glsl"

void main()
{
  drawn_position = (view.object_to_world * vec4(vertex_place(places, gl_VertexID), 1.0)).xyz;
  gl_Position = view.world_to_clip * vec4(drawn_position, 1.0);
}
