// SPDX-License-Identifier: GPL-3.0-or-later
// Color of all strands of a hair object. A program for linked objects includes strands/batch_tint.glsl in place of this file.

vec3 solid_tint()
{
  return solid.tint.rgb;
}
