// SPDX-License-Identifier: GPL-3.0-or-later
// The energy-conserving Marschner model for strands that differ in absorption and roughness.

#include "fibre/varied_fibre.glsl"

float fibre_roughness()
{
  return this_roughness();
}

vec4 forward_channel(vec2 at, float sigma_a)
{
  float slice_count = float(textureSize(n_g_slices, 0).z);
  vec2 place = slice_of(sigma_a, slices.low, slices.high, int(slice_count));
  vec4 below = textureLod(n_g_slices, vec3(at, (place.x + 0.5) / slice_count), 0.0);
  vec4 above = textureLod(n_g_slices, vec3(at, (place.x + 1.5) / slice_count), 0.0);
  return geometric_mix(below, above, place.y);
}

FibreLobes forward_lobes(vec2 at)
{
  vec3 sigma_a = this_sigma_a();
  return side_by_side(forward_channel(at, sigma_a.r),
                      forward_channel(at, sigma_a.g),
                      forward_channel(at, sigma_a.b));
}

#include "fibre/dual_along.glsl"

void hair_return(float sin_theta_o, out vec3 returned, out vec3 towards, out vec3 zonal_1, out vec3 zonal_2)
{
  fibre_return(sin_theta_o, returned, towards, zonal_1, zonal_2);
}

#include "fibre/dual_radiance.glsl"
#include "fibre/shade_strand.glsl"
