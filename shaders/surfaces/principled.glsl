// SPDX-License-Identifier: GPL-3.0-or-later
// Principled Hair's roughness → the widths of lobes [Chiang16].

#include "fibre/scattering_kernel.glsl"

// Roughness of a strand with a random number in [0, 1]; amount: maximum relative change.
float varied_roughness(float roughness, float amount, float random)
{
  return clamp(roughness * (1.0 + 2.0 * (random - 0.5) * amount), 0.0, 1.0);
}
