// SPDX-License-Identifier: GPL-3.0-or-later
// Light among strands that paths through a grid of them have found: needs the sampler light_grid.

bool has_light_grid()
{
  return lights.grid_scale.x > 0.0;
}

// Radiance that arrives at visible strands around a place, as even light that they would send to the viewer alike.
vec3 light_among_strands(vec3 position)
{
  return textureLod(light_grid, (position - lights.grid_corner.xyz) * lights.grid_scale.xyz, 0.0).rgb;
}
