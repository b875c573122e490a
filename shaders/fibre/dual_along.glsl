// SPDX-License-Identifier: GPL-3.0-or-later
// Scattering by the strands around, at the same position along the gradient from the root's color to the tip's: needs the
// sampler dual_table, slices of which run along the gradient.

vec3 dual(float row, float theta_i)
{
  float step_count = float(textureSize(dual_table, 0).z);
  vec3 at = vec3(theta_i / PI + 0.5, (row + 0.5) / 9.0, between_ends(this_gradient(), step_count));
  return textureLod(dual_table, at, 0.0).rgb;
}
