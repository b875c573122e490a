// SPDX-License-Identifier: GPL-3.0-or-later
// Light among strands, measured by paths through a grid: needs the sampler light_grid.

bool has_light_grid()
{
  return lights.grid_scale.x > 0.0;
}

// For visible strands around a position: RGB, the uniform radiance to which they would respond alike; alpha, the fraction of
// light by dual scattering to add.
vec4 light_among_strands(vec3 position)
{
  vec4 measured = textureLod(light_grid, (position - lights.grid_corner.xyz) * lights.grid_scale.xyz, 0.0);
  return mix(vec4(0.0, 0.0, 0.0, 1.0), measured, lights.grid_corner.w);
}
