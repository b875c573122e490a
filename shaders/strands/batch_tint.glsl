// SPDX-License-Identifier: GPL-3.0-or-later
// Color of all strands of the linked hair object of a thread: replaces fibre/solid_tint.glsl.

vec3 solid_tint()
{
  return object_texel(object_row, TINT_TEXEL).rgb;
}
