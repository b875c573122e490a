// SPDX-License-Identifier: GPL-3.0-or-later
// Light among strands that paths through a grid of them have found: needs the sampler light_grid.

bool has_light_grid()
{
  return lights.grid_corner.w > 0.0;
}

// Radiance that arrives at visible strands around a place, as even light that they would send to the viewer alike.
vec3 light_among_strands(vec3 position)
{
  vec3 at = (position - lights.grid_corner.xyz) * lights.grid_corner.w;
  return textureLod(light_grid, at / vec3(textureSize(light_grid, 0)), 0.0).rgb;
}
