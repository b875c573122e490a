// SPDX-License-Identifier: GPL-3.0-or-later
// A vertex of a surface in this frame, the previous frame and, for HAS_PLACE_AFTER, the next frame, each in the object's local
// coordinates.

#include "surfaces/vertex_position.glsl"

// Distance in clip space, relative to w, by which surfaces are drawn in front of their depth in the buffer: other programs have
// drawn it, which drivers may round otherwise.
const float NEARER = 1.0e-6;

void main()
{
  vec4 place = vec4(vertex_place(places, gl_VertexID), 1.0);
  place_now = motion.now_to_clip * place;
  place_before = motion.before_to_clip * vec4(vertex_place(places_before, gl_VertexID), 1.0);
#if defined(HAS_PLACE_AFTER)
  place_after = motion.after_to_clip * vec4(vertex_place(places_after, gl_VertexID), 1.0);
#endif
  vec3 drawn_place = (view.object_to_world * place).xyz;
  gl_Position = view.world_to_clip * vec4(drawn_place, 1.0);
#if !defined(HAS_PLACE_AFTER)
  gl_Position.z -= NEARER * gl_Position.w;
#endif
}
