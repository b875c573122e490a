// SPDX-License-Identifier: GPL-3.0-or-later
// Corners of triangles by their places in a texture: there a driver has what was just uploaded at hand, as vertices may
// stay in the host's memory until they were drawn some times.

#include "include/strand.glsl"

void main()
{
  ivec2 corner = strand_texel(gl_VertexID, 0, 1, textureSize(places, 0).x);
  vec4 place = texelFetch(places, corner, 0);
  drawn_position = place.xyz;
  packed_color = place.w;
  gl_Position = view.world_to_clip * vec4(drawn_position, 1.0);
}
