// SPDX-License-Identifier: GPL-3.0-or-later
// Principled Hair's roughness → the widths of lobes [Chiang16].

// Standard deviation of the R lobe in theta_i + theta_o for a longitudinal roughness in [0, 1].
float deviation_from_roughness(float roughness)
{
  return roughness * (0.726 + 0.812 * roughness) + 3.7 * pow(roughness, 20.0);
}

// v_R for a longitudinal roughness in [0, 1].
float variance_from_roughness(float roughness)
{
  float deviation = deviation_from_roughness(roughness);
  return max(deviation * deviation, 1e-4);
}

// Roughness of a strand with a random number in [0, 1]; amount: maximum relative change.
float varied_roughness(float roughness, float amount, float random)
{
  return clamp(roughness * (1.0 + 2.0 * (random - 0.5) * amount), 0.0, 1.0);
}
