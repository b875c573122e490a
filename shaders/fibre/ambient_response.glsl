// SPDX-License-Identifier: GPL-3.0-or-later
// Response of a strand to ambient light, from the table of `albedo.azimuthal_moments`: needs the sampler
// return_table.

void hair_return(float sin_theta_o, out vec3 returned, out vec3 towards, out vec3 zonal_1, out vec3 zonal_2)
{
  float u = atan(sin_theta_o, sin_from_cos(sin_theta_o)) / PI + 0.5;
  returned = textureLod(return_table, vec2(u, 0.125), 0.0).rgb;
  towards = textureLod(return_table, vec2(u, 0.375), 0.0).rgb;
  zonal_1 = textureLod(return_table, vec2(u, 0.625), 0.0).rgb;
  zonal_2 = textureLod(return_table, vec2(u, 0.875), 0.0).rgb;
}
