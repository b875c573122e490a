// SPDX-License-Identifier: GPL-3.0-or-later
// The drawn components of a strand's light: those of a pass, by the constants part_lobes and part_world, or all.

vec4 drawn_lobes;
float drawn_world;

bool is_part_of_light()
{
  return true;
}

void draw_part(bool is_part)
{
  drawn_lobes = is_part ? part_lobes : vec4(1.0);
  drawn_world = is_part ? part_world : 1.0;
}
