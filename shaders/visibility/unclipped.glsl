// SPDX-License-Identifier: GPL-3.0-or-later
// A view without clipping: visibility/clipped.glsl replaces this file in views with clipping planes.

const bool IS_CLIPPED = false;

bool is_cut_off(vec3 place)
{
  return false;
}

vec2 part_left(vec3 start, vec3 end)
{
  return vec2(0.0, 1.0);
}
