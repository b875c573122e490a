// SPDX-License-Identifier: GPL-3.0-or-later
// A corner of a triangle, where it is, was a frame before, and will be a frame after.

void main()
{
  ivec2 texel = ivec2(gl_VertexID % view.row_strands, gl_VertexID / view.row_strands);
  place_now = motion.now_to_clip * vec4(position, 1.0);
  place_before = motion.before_to_clip * vec4(texelFetch(places_before, texel, 0).xyz, 1.0);
  place_after = motion.after_to_clip * vec4(texelFetch(places_after, texel, 0).xyz, 1.0);
  gl_Position = view.world_to_clip * vec4(position, 1.0);
}
