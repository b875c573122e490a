// SPDX-License-Identifier: GPL-3.0-or-later
// Vertices of linked surfaces in depth-only passes, an instance for each: as surfaces/surface_depth.vert.

#include "surfaces/linked_transform.glsl"
#include "surfaces/vertex_position.glsl"

void main()
{
  drawn_position = (linked_transform(gl_InstanceID) * vec4(vertex_place(places, gl_VertexID), 1.0)).xyz;
  gl_Position = view.world_to_clip * vec4(drawn_position, 1.0);
}
