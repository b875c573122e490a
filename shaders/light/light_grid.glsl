// SPDX-License-Identifier: GPL-3.0-or-later
// Light among strands that paths through a grid of them have found: needs the sampler light_grid.

bool has_light_grid()
{
  return lights.grid_scale.x > 0.0;
}

// Of visible strands around a place: RGB, radiance that arrives among strands, as even light that they would send to the
// viewer alike; alpha, the part of light by dual scattering that is kept beside it.
vec4 light_among_strands(vec3 position)
{
  return textureLod(light_grid, (position - lights.grid_corner.xyz) * lights.grid_scale.xyz, 0.0);
}
