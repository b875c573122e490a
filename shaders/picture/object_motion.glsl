// SPDX-License-Identifier: GPL-3.0-or-later
// Transforms of a single hair object for motion vectors: the block `motion`. picture/batch_motion.glsl replaces this file in
// programs that draw linked objects together.

mat4 before_to_clip()
{
  return motion.before_to_clip;
}

mat4 now_to_clip()
{
  return motion.now_to_clip;
}

mat4 after_to_clip()
{
  return motion.after_to_clip;
}
