// SPDX-License-Identifier: GPL-3.0-or-later
// A vertex of a surface in this frame, the previous frame and the next frame, each in the object's local coordinates.

#include "surfaces/vertex_position.glsl"

void main()
{
  vec4 place = vec4(vertex_place(places, gl_VertexID), 1.0);
  place_now = motion.now_to_clip * place;
  place_before = motion.before_to_clip * vec4(vertex_place(places_before, gl_VertexID), 1.0);
  place_after = motion.after_to_clip * vec4(vertex_place(places_after, gl_VertexID), 1.0);
  gl_Position = view.world_to_clip * (view.object_to_world * place);
}
