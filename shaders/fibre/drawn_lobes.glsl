// SPDX-License-Identifier: GPL-3.0-or-later
// The drawn components of a strand's light: all. Programs of passes include fibre/part_of_lobes.glsl in place of this file.

const vec4 drawn_lobes = vec4(1.0);  // R, TT, TRT and all other light from lights
const float drawn_world = 1.0;

bool is_part_of_light()
{
  return false;
}

void draw_part(bool is_part) {}
