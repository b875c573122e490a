// SPDX-License-Identifier: GPL-3.0-or-later
// Transforms of a linked hair object for motion vectors, from its row of the texture `object_motions`: replaces
// picture/object_motion.glsl.

mat4 motion_matrix(int texel)
{
  return mat4(texelFetch(object_motions, ivec2(texel, object_row), 0),
              texelFetch(object_motions, ivec2(texel + 1, object_row), 0),
              texelFetch(object_motions, ivec2(texel + 2, object_row), 0),
              texelFetch(object_motions, ivec2(texel + 3, object_row), 0));
}

mat4 before_to_clip()
{
  return motion_matrix(0);
}

mat4 now_to_clip()
{
  return motion_matrix(4);
}

mat4 after_to_clip()
{
  return motion_matrix(8);
}
