// SPDX-License-Identifier: GPL-3.0-or-later
// A view that shows all: visibility/clipped.glsl takes the place of this file where planes cut something off.

const bool IS_CLIPPED = false;

bool is_cut_off(vec3 place)
{
  return false;
}

vec2 part_left(vec3 start, vec3 end)
{
  return vec2(0.0, 1.0);
}
